"""The command line, one module a command: each parses, calls the rooms, and prints.

Every import beyond click waits until a command needs it, so that help comes at once. Bad input
ends in one sentence on stderr and exit code 2.
"""

import click

from vsctrl.cli.bode import bode
from vsctrl.cli.compare import compare
from vsctrl.cli.derive import derive
from vsctrl.cli.loop import loop
from vsctrl.cli.margins import margins
from vsctrl.cli.new import new
from vsctrl.cli.options import EXIT_CODES
from vsctrl.cli.output import Commands
from vsctrl.cli.report import report
from vsctrl.cli.roots import roots
from vsctrl.cli.simulate import simulate
from vsctrl.cli.step import step

# What people come for, and what they type then.
_FIRST = """\
Describe a loop with dead time, or a camera:   vsctrl new fopdt > mine.toml  (vsctrl new: all)
Is it stable, how far off, how fast, and why:  vsctrl report mine.toml --open
How close is it to shaking:                    vsctrl margins mine.toml      (bode, step, roots)
Which of two is better:                        vsctrl compare mine.toml other.toml
How far behind will a camera be, by a run:     vsctrl simulate camera.toml   (vsctrl new sliding)"""
_EPILOG = f"""{EXIT_CODES}

\b
Completion of commands and options, in the shell's start file:
  bash  eval "$(_VSCTRL_COMPLETE=bash_source vsctrl)"
  zsh   eval "$(_VSCTRL_COMPLETE=zsh_source vsctrl)"
  fish  _VSCTRL_COMPLETE=fish_source vsctrl | source"""


@click.group(
    cls=Commands,
    invoke_without_command=True,
    epilog=_EPILOG,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 96},
)
@click.version_option(package_name="vsctrl", message="vsctrl %(version)s")
@click.pass_context
def main(ctx: click.Context) -> None:
    """Loops with dead time, and cameras that servo: stable, how far off, how fast, and why."""
    if ctx.invoked_subcommand is None:
        click.echo(_FIRST)


for command in (new, report, compare, margins, bode, step, roots, loop, simulate, derive):
    main.add_command(command)
