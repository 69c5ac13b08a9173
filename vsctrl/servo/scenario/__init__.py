"""The description of an experiment: its tables, their checks, its file, and its parts assembled."""

from vsctrl.servo.scenario.description import COMMENTS as COMMENTS
from vsctrl.servo.scenario.scenario import GivenScenario as GivenScenario
from vsctrl.servo.scenario.scenario import Scenario as Scenario
from vsctrl.servo.scenario.scenario import as_scenario as as_scenario
from vsctrl.servo.scenario.scenario import schema as schema
