# %% [markdown]
# # Five minutes with vsctrl
#
# A controller acts on news that is late: of a reactor, a motor at the end of a network, a camera.
# How much can it be trusted, and how fast may it go? One loop, looked at from all sides; everything
# below takes the dead time as it is, without an approximation.
#
# This tour is for everybody. Afterwards there are three doors: [any process with dead
# time](07_block_diagrams.ipynb), [a camera that lags](01_the_one_over_lambda_law.ipynb), and [the
# paper that it all began with](02_interaction_matrices.ipynb).

# %%
import vsctrl as vs

# %% [markdown]
# ## A loop as a picture
# A process with a time constant of 5 min answers 1 min late, and a PI controller keeps it where it
# should be. `vsctrl new fopdt > mine.toml` writes the file; here it is read from the package's own
# examples. A loop shows itself by its wiring.

# %%
from importlib.resources import files

loop = vs.load(files("vsctrl.examples") / "fopdt.toml")
loop

# %% [markdown]
# ## Its margins as a table
# Is it stable, and how much would it take to make it unstable? Three times the gain, or two more
# minutes of dead time. (The file counts in minutes, the margins in seconds: 128.5 s.)

# %%
loop.open.margins()

# %% [markdown]
# ## All of it in one figure
# `vs.plot` draws anything that vsctrl computes. Of a loop: the Bode diagram with those margins
# marked, the characteristic roots, and the answer to what the file says happens, a step of the
# set-point.

# %% tags=["thumbnail"]
vs.plot(loop)

# %% [markdown]
# Notice the response: for one minute nothing happens at all. A rational (Padé) model of the dead
# time would start to move at once, in the wrong direction.
#
# ## What if?
# `with_` is the same loop with other numbers. Four times the gain is more than the margin of 3.142:

# %%
hasty = loop.with_(K=10)
hasty.open.margins()

# %% [markdown]
# Between the two lies an edge, here over the gain *and* the dead time. It is traced, as the place
# where a root crosses the imaginary axis, not guessed from a raster.

# %%
chart = loop.system.stability_chart(K=(0.5, 12), theta=(10, 180), grid=(18, 12))
vs.plot(chart)

# %% [markdown]
# ## A mistake
# Everybody mistypes. What is refused is refused in a sentence that names what is wrong and what to
# do about it, and that can be caught like any other exception.

# %%
try:
    loop.with_(thta=90)
except vs.InputError as refused:
    print(refused)

# %% [markdown]
# ## A report to hand over
# One call writes `index.html`, which needs nothing else, and `report.json` with every number. It
# returns where they are and what the page says first.

# %% tags=["long"]
from tempfile import mkdtemp

written = vs.write_report(loop, out=mkdtemp())
print(written.page.name, *written.sentences, sep="\n")

# %% [markdown]
# ## The same for a camera
# That is what vsctrl began with. A camera follows a moving reference image with an image that is 80
# ms old. The linear loop of such a scenario is a loop like the one above, and answers the same
# questions: it may go at 15.45 s⁻¹ and not faster, and it will be 3.2 mm *ahead* of where it should
# be.

# %%
vs.loop.of(vs.paper.sliding())

# %% [markdown]
# And a simulation in six degrees of freedom, which knows nothing of that theory, agrees to the
# micrometre:

# %%
run = vs.simulate(vs.paper.sliding())
print(f"{1e3 * run.lag_along_motion[-1]:+.3f} mm along the motion at the end")

# %% [markdown]
# How that comes about, and what to do about it, is what [the next
# notebook](01_the_one_over_lambda_law.ipynb) tells.
