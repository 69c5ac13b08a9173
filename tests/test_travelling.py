"""Every public object goes to another process and back: fresh and used, with the same numbers.

What is asked of a copy is asked of the object itself; the copy has to work it out anew.
"""

import copy
import multiprocessing
import pickle
import threading
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import numpy as np
import pytest

import vsctrl as vs
from vsctrl import derive, examples, loop, study
from vsctrl.study.compensation.compensators import remedies
from vsctrl.symbols import k_ff

DIGITAL = {"feed-forward": "backward"}
T = np.linspace(0.0, 0.5, 6)


@cache
def scenario():
    return vs.paper.sliding().with_(duration=2.0)


def system():
    # Parts in a new diagram, whose caches are empty whatever ran before.
    new = vs.Diagram(loop.figure1.parts, loop.figure1.inputs, loop.figure1.outputs)
    return new.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)


def opened():
    return system().open("S_meas")


def offered():
    """Every remedy there is, untried."""
    return [r for r in remedies(scenario().ideal, [0.04], None) if not isinstance(r, str)]


def treated(remedy):
    limit = study.Measured(
        case=remedy.name, predicted=1.0, exact=1.0, simulated=None, allowed=0.1, reason=""
    )
    return study.Treated(remedy=remedy, error=None, seen=None, limit=limit)


def sampled():
    return system().sampled(0.04, digital=DIGITAL)


def predictor():
    return loop.smith().at(lam=2.5, tau=0.08, tau_hat=0.08, ell=1, ell_hat=1, k_ff=0)


#: how each is made, and what is asked of it: something that can be compared
OBJECTS = {
    "diagram": (lambda: system().diagram, lambda x: (x.transfer("S_ref", "S"), x._repr_svg_())),
    "opened diagram": (
        lambda: system().diagram.open("S_meas"),
        lambda x: str(x.transfer("S_meas__cut", "S_meas").subs(k_ff, 1)),
    ),
    "subdiagram": (lambda: system().diagram.block("servo", "a -> b"), str),
    "system": (system, lambda x: (x.poles(4), x.unstable_roots, x["S_ref", "S"](1j))),
    "system of a predictor": (predictor, lambda x: x["S_ref", "S"].poles(2)),
    "channel": (
        lambda: system()["S_ref", "S"],
        lambda x: (x(1j * T[1:]), x.response(vs.Ramp(0.04), T).outputs, x.poles(2)),
    ),
    "history": (
        lambda: system()["S_ref", "S"],
        lambda x: x.response(vs.Ramp(), T, history={"S": 1.0}).outputs,
    ),
    "opened loop": (opened, lambda x: x.margins()),
    "margins": (lambda: opened().margins(), repr),
    "roots": (lambda: system().roots_right_of(-1), repr),
    "chart": (
        lambda: system().stability_chart(lam=(1, 30), tau=(0.05, 0.2), grid=(5, 4)),
        lambda x: x.unstable,
    ),
    "Padé model": (
        lambda: opened().pade(3),
        lambda x: (x.A, x.error([1.0]), x.dynamics(0, [1.0] * x.nstates, [0.0])),
    ),
    "check": (lambda: system().check(), str),
    "sampled system": (sampled, lambda x: (x.poles(), x.is_stable)),
    "sampled channel": (lambda: sampled()["S_ref", "S"], lambda x: x(np.exp(0.1j))),
    "sampled loop": (lambda: sampled().open("T"), lambda x: x.margins()),
    "loop": (
        lambda: vs.Loop.from_toml(examples.text("smith")),
        lambda x: (x.open.margins(), str(x), x.horizon),
    ),
    "signal": (lambda: vs.Step() + 2 * vs.Samples([0, 1, 0], 0.1).delayed(0.1), lambda x: x(T)),
    "scenario": (scenario, lambda x: x.digest),
    "run": (lambda: vs.simulate(scenario()), lambda x: (x.pose, str(x.status))),
    "comparison": (lambda: vs.validate(scenario()), str),
    "remedies": (
        lambda: study.Remedies(scenario(), 0.04, tuple(map(treated, offered()))),
        lambda x: (str(x), [row.remedy.limits.continuous(1.0) for row in x.rows]),
    ),
    "summary": (lambda: loop.error_constants(loop.figure1, "S_meas"), str),
    "point": (derive.Point, derive.interaction_matrix),
    "moments": (derive.GravityCentre, derive.interaction_matrix),
    "line": (derive.Line, repr),
    "points": (lambda: derive.copies(derive.Point(), 2), derive.interaction_matrix),
    "camera": (lambda: derive.PIXELS, repr),
    "claim": (lambda: derive.ledger()[0], str),
    "error": (lambda: vs.InputError("a sentence."), str),
}


#: those that keep nothing, and so are as fresh after they were asked as before
RESULTS = {"run", "comparison", "remedies", "chart", "check", "margins", "roots", "scenario"}


def same(a, b):
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return bool(a == b) or repr(a) == repr(b)


@cache
def made(name):
    """(a fresh one, a used one, what it answers)."""
    make, ask = OBJECTS[name]
    used = make()
    return (used if name in RESULTS else make()), used, ask(used)


def answer(name, thing):
    """What a copy answers; runs in the other process."""
    return OBJECTS[name][1](thing)


@pytest.mark.parametrize("name", OBJECTS)
def test_a_copy_of_it_fresh_or_used_answers_the_same(name):
    fresh, used, known = made(name)
    for thing in (fresh, used):
        assert type(copy.copy(thing)) is type(thing)
        assert same(answer(name, pickle.loads(pickle.dumps(thing))), known)
    assert same(answer(name, copy.deepcopy(used)), known)


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_it_comes_back_from_another_process_with_the_same_numbers(method):
    """Those that are cheap to ask: the way is the same for all."""
    names = ["diagram", "Padé model", "point"]
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        for name in names:
            fresh, used, known = made(name)
            answers = pool.map(answer, [name] * 2, [fresh, used])
            assert all(same(told, known) for told in answers), name
            assert type(pool.submit(copy.copy, used).result()) is type(used)


def test_a_diagram_is_copied_while_others_use_it():
    """Its caches grow meanwhile, from other threads and from the copying itself."""
    diagram, done = system().diagram, threading.Event()

    def use():
        for target in diagram.signals * 3:
            diagram.transfer("S_ref", target)
            diagram.evaluator("S_ref", target)
            if target not in diagram.inputs:
                vars(diagram).pop("_opened", None)
        done.set()

    user = threading.Thread(target=use)
    user.start()
    while not done.is_set():
        assert copy.deepcopy(diagram) == diagram
        assert pickle.loads(pickle.dumps(diagram)) == diagram
    user.join()
