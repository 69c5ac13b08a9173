"""The command line, one module a command: each parses, calls the rooms, and prints.

Every import beyond click waits until a command needs it, so that help comes at once. Bad input
ends in one sentence on stderr and exit code 2.
"""

import click

from vsctrl.cli.derive import derive
from vsctrl.cli.loop import loop
from vsctrl.cli.new import new
from vsctrl.cli.output import Commands
from vsctrl.cli.report import report
from vsctrl.cli.simulate import simulate


@click.group(
    cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 96}
)
@click.version_option(package_name="vsctrl", message="vsctrl %(version)s")
def main() -> None:
    """How far behind a visual-servoing camera will be, how fast it may go, and why."""


for command in (new, report, loop, simulate, derive):
    main.add_command(command)
