"""The command `gyrfalcon`: campaigns here or on a Ray cluster.

Exit status: 0 no guarantee was violated, 1 one was, 2 wrong usage or definition, 3 results cannot be written,
4 the cluster failed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from typing import Any

from .campaigns import CampaignResult, campaign
from .errors import GyrfalconError


def main(words: Sequence[str] | None = None) -> int:
    """Runs the command; returns its exit status."""
    arguments = _parser().parse_args(words)
    try:
        result = _fly(arguments)
    except (GyrfalconError, ValueError) as error:
        return _failed(error, 2)
    except OSError as error:
        return _failed(error, 3)
    print(result)
    for variant, evidence in result.evidence.items():
        print(f"{variant}: {json.dumps(evidence)}")
    return 0 if result.passed else 1


def _fly(arguments: argparse.Namespace) -> CampaignResult:
    options: dict[str, Any] = {
        "out": arguments.out,
        "set": dict(_change(change) for change in arguments.set),
        "runs": arguments.runs,
        "first_seed": arguments.first_seed,
        "progress": not arguments.quiet,
    }
    if arguments.ray is None:
        return campaign(arguments.campaign, **options)
    import ray

    from . import distributed

    address = None if arguments.ray == "local" else arguments.ray
    shards = arguments.shards
    try:
        return distributed.campaign(arguments.campaign, shards=shards, address=address, **options)
    except (ray.exceptions.RayError, ConnectionError) as error:
        raise SystemExit(_failed(error, 4)) from error


def _change(text: str) -> tuple[str, Any]:
    """`path=value` with a value of Python's literals, or else a string."""
    import ast

    path, separator, value = text.partition("=")
    if not separator:
        raise ValueError(f"--set {text}: expected path=value")
    try:
        return path, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return path, value


def _failed(error: BaseException, status: int) -> int:
    print(f"error: {error}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="gyrfalcon", description="Flies campaigns.")
    commands = parser.add_subparsers(required=True)
    fly = commands.add_parser("campaign", help="fly a campaign, here or on a Ray cluster")
    fly.add_argument("campaign", metavar="NAME|FILE", help="built-in campaign or TOML file")
    fly.add_argument("--out", default="out", metavar="DIR", help="folder of results")
    fly.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    fly.add_argument("--runs", type=int, metavar="N")
    fly.add_argument("--first-seed", type=int, metavar="N")
    fly.add_argument("--ray", metavar="ADDRESS", help="of a Ray cluster; `local` starts one here")
    fly.add_argument("--shards", type=int, default=8, metavar="N", help="tasks on the cluster")
    fly.add_argument("--quiet", action="store_true", help="show no progress")
    return parser


if __name__ == "__main__":
    sys.exit(main())
