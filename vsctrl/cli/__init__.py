"""The command line, one module a command: each parses, calls the rooms, and prints.

Every import beyond click waits until a command needs it, so that help comes at once. Bad input
ends in one sentence on stderr and exit code 2.
"""

import click

from vsctrl.cli.derive import derive
from vsctrl.cli.loop import loop
from vsctrl.cli.new import new
from vsctrl.cli.options import EXIT_CODES
from vsctrl.cli.output import Commands
from vsctrl.cli.report import report
from vsctrl.cli.simulate import simulate

# What people come for, and what they type then.
_FIRST = """\
How fast may a loop with dead time go?   vsctrl loop --gain 2.5 --delay 0.08 --period 0.04
How far behind will a camera be?         vsctrl report
Describe a loop or an experiment:        vsctrl new fopdt > mine.toml, edit, vsctrl report mine.toml
Run it frame by frame:                   vsctrl simulate mine.toml --set lam=5 --plot run.png
Derive an interaction matrix:            vsctrl derive point --emit numpy"""
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
    """How far behind a visual-servoing camera will be, how fast it may go, and why."""
    if ctx.invoked_subcommand is None:
        click.echo(_FIRST)


for command in (new, report, loop, simulate, derive):
    main.add_command(command)
