"""The description of an experiment: tables, checks, and the text of its file."""

from vsctrl.servo.scenario.experiment import Placement as Placement
from vsctrl.servo.scenario.scenario import COMMENTS as COMMENTS
from vsctrl.servo.scenario.scenario import Scenario as Scenario
from vsctrl.servo.scenario.scenario import schema as schema
