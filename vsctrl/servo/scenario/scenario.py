"""One experiment that can be simulated: what users make, vary, load and save.

A ``Scenario`` is frozen and valid: whatever exists can be simulated. Every way to make one (a TOML
file, keywords, a variation of another one) passes the same checks and fails with one ``InputError``
that lists all problems. Checks of single values are in ``fields``, of the whole in ``checks``.
"""

import hashlib
import inspect
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from vsctrl import files, toml
from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.problems import FieldsError, Problem, remedy
from vsctrl.servo.pose import exp
from vsctrl.servo.scenario import overview, settings
from vsctrl.servo.scenario.checks import (
    frame_problems,
    image_problems,
    path_problems,
    plan_problems,
    start_problems,
)
from vsctrl.servo.scenario.contradictions import contradictions
from vsctrl.servo.scenario.description import COMMENTS, TABLE_OF, TABLES, Description, meanings
from vsctrl.servo.scenario.links import KINDS, LinkedMotion
from vsctrl.servo.scenario.plausibility import CERTAIN, asked, questions
from vsctrl.tables import html


class Scenario(Description):
    """One experiment, valid by construction; units and meaning of each field in its table.

    Raises InputError, with one sentence per problem, for anything that cannot be simulated.

    >>> scenario = vs.paper.sliding().with_(noise_px=0.3)
    >>> scenario.vision.noise_px
    0.3
    """

    def problems(self) -> Iterator[Problem]:
        """Everything that keeps the experiment from being simulated, as far as it can be told."""
        points = np.array(self.target.points)
        position, offset = np.array(self.start.position), np.array(self.start.offset)
        try:
            reference = self.reference
        except InputError as error:
            yield "motion", str(error).rstrip(".")
            return
        blamed = "motion.duration" if "duration" in type(self.motion).model_fields else "motion"
        slips = [] if self.sure else [*questions(self, reference)]
        if refusing := [(q.field, q.sentence + CERTAIN) for q in slips if q.refuses]:
            # What else is wrong most likely comes from these.
            yield from [*contradictions(self), *refusing]
            return
        problems = [
            *contradictions(self),
            *frame_problems(reference.duration, self.vision.period, len(points), blamed),
            *start_problems(points, position, reference.oTc0, offset),
        ]
        if not problems:
            what = "motion.V" if self.motion.kind == "screw" else "motion"
            problems += path_problems(points, reference, self.t, what)
        if not problems:
            problems += [*plan_problems(self), *image_problems(self, reference.oTc0 @ exp(offset))]
        yield from problems

    @property
    def doubts(self) -> tuple[str, ...]:
        """Questions about what is unusual and stops nothing, each a sentence; none if ``sure``."""
        return tuple(f"{question.field}: {question.sentence}" for question in asked(self))

    @property
    def ideal(self) -> Self:
        """The same experiment as the theory of figure 1 has it: a perfect camera and robot.

        What remains: lens and points, start (without offset), motion, period and latency, the law
        (10) with its wrong depths and focal length. What a law may have besides is left out.
        """
        kept = ("lam", "k_ff", "interaction", "placement", "depth_ratio")
        return type(self)(
            name=self.name,
            description=self.description,
            sure=self.sure,
            camera={"Fx": self.camera.Fx, "Fy": self.camera.Fy},
            target={"points": self.target.points},
            start={
                "position": self.start.position,
                "euler_xyz_deg": self.start.euler_xyz_deg,
            },
            motion=self.motion,
            law={name: getattr(self.law, name) for name in kept},
            vision={"period": self.vision.period, "latency": self.vision.latency},
            calibration={"focal_ratio": self.calibration.focal_ratio},
        )

    @property
    def beyond_theory(self) -> dict[str, Any]:
        """What this scenario has and its ideal has not, by dotted names of its keys."""
        own, ideal = self.model_dump(), self.ideal.model_dump()
        return {
            f"{table}.{name}": value
            for table in TABLES
            for name, value in own[table].items()
            if value != ideal[table][name] and name != "seed"  # of what is random, and listed
        }

    @property
    def digest(self) -> str:
        """First 12 hex digits of the SHA-256 of the canonical JSON: same digits, same run.

        Values at their defaults are left out, so that a new option leaves old digests alone, and
        so is ``sure``, which changes no run.
        """
        data = self.model_dump(mode="json", exclude_defaults=True, exclude={"sure"})
        canonical = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()[:12]

    def __str__(self) -> str:
        """Six lines: what it is, what moves, camera, law, vision, and what is beyond theory."""
        return overview.text(self, self.beyond_theory, self.doubts)

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        (name, about), *rest = overview.rows(self, self.beyond_theory)
        title = ": ".join(filter(None, (name, about)))
        return html(rest, caption=title, remarks=self.doubts, labels=True, left=2)

    def with_(self, **changes: Any) -> Self:
        """The same experiment with some fields changed, by their own names: ``with_(lam=5)``.

        Another ``kind`` of motion keeps only those keys of the old one that it has itself.
        Raises InputError for an unknown name or a value that its field refuses.
        """
        data: dict[str, Any] = self.model_dump()
        table_of = TABLE_OF | {"sure": ""}
        unknown = [name for name in changes if name not in table_of]
        if unknown:
            raise FieldsError(
                (
                    name,
                    f"no field of a scenario has this name{remedy(name, table_of, changes[name])}",
                )
                for name in unknown
            )
        kind = KINDS.get(str(changes.get("kind", self.motion.kind)))
        if kind is not None:
            data["motion"] = {k: v for k, v in data["motion"].items() if k in kind.model_fields}
        for name, value in changes.items():
            table = table_of[name]
            (data[table] if table else data)[name] = value
        return type(self)(**data)

    def with_text(self, changes: Mapping[str, str]) -> Self:
        """The same experiment with fields changed by text: ``{"law.lam": "5", "V": "[0, 0, 0]"}``.

        A value is written as in a file, a word without quotes too, and what may be left out is
        ``none``. Raises InputError as ``with_``.
        """
        return self.with_(**settings.values(changes, self.motion.kind))

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Scenario from TOML text. Raises InputError that lists all problems."""
        return cls(**toml.parse(text))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Scenario from a TOML file in UTF-8. Raises InputError that starts with the file."""
        try:
            return cls.from_toml(files.read_text(files.as_path("path", path), "TOML file"))
        except FieldsError as error:
            raise FieldsError(error.problems, source=str(path)) from None

    def to_toml(self) -> str:
        """TOML text, ready to edit: a comment with meaning and unit on every key.

        ``Scenario.from_toml`` makes exactly the same scenario of it.
        """
        comments = COMMENTS | meanings("motion", type(self.motion))
        if isinstance(self.motion, LinkedMotion):
            for number, part in enumerate(self.motion.parts):
                comments |= meanings(f"motion.parts.{number}", type(part))
        return toml.emit(self.model_dump(), comments)

    def save(self, path: str | Path) -> None:
        """Write ``to_toml`` to a file: all of it or nothing. Raises InputError if impossible."""
        files.write(files.as_path("path", path), self.to_toml(), "scenario")


GivenScenario = Scenario | str | Path  #: a scenario, or the path of its TOML file


def as_scenario(given: object) -> Scenario:
    """The scenario that was given, or that is in the TOML file whose path was.

    Raises InputError for a file that has none, and for what is neither, with what to give.
    """
    if isinstance(given, Scenario):
        return given
    if isinstance(given, str | Path):
        try:
            return Scenario.load(given)
        except FieldsError as error:
            raise FieldsError(error.problems, f"scenario: {given}") from None
        except InputError as error:
            raise InputError(f"scenario: {error}") from None
    raise InputError(f"scenario: {_no_scenario(given)}.")


def _no_scenario(given: object) -> str:
    remedy = "give one, such as vs.paper.sliding(), or the path of its TOML file"
    if isinstance(given, type) and issubclass(given, Scenario):
        return f"{given.__name__} is the class, not an experiment; {remedy}"
    if isinstance(given, Mapping):
        return "a dict of tables is no Scenario yet; give vs.Scenario(**tables)"
    if isinstance(getattr(given, "scenario", None), Scenario):
        return f"a {type(given).__name__} is no Scenario; give its own, as run.scenario"
    name = getattr(given, "__name__", "")
    if name and callable(given):
        return f"{name} is no Scenario; if it makes one, call it: {name}()"
    return f"{quoted(given)} is no Scenario; {remedy}"


_SUMMARY = inspect.cleandoc(Scenario.__doc__ or "")
Scenario.__doc__ = f"""{_SUMMARY}

The tables of a file, their keys with what they are where left out, meaning and unit:
{overview.manual()}
"""
Scenario.with_.__doc__ = f"""{inspect.cleandoc(Scenario.with_.__doc__ or "")}

The names, by table:
{overview.keys()}
"""


def schema() -> str:
    """JSON Schema of a scenario file, for editors that complete and check TOML or JSON.

    >>> import json
    >>> json.loads(vs.servo.schema())["type"]
    'object'
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    found = head | Scenario.model_json_schema() | {"description": _SUMMARY.split("\n\n>>>")[0]}
    return json.dumps(found, indent=2, ensure_ascii=False) + "\n"
