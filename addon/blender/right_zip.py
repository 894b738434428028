"""Whether this zip is for this Blender on this computer, and if not, which one is."""

import json
import platform
import sys
from pathlib import Path

MADE_FOR = Path(__file__).with_name("made_for.json")  # written by `make addon`
_SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "macos"}
_MACHINES = {"x86_64": "x64", "amd64": "x64", "arm64": "arm64", "aarch64": "arm64"}


def this_platform():
    """This computer, in Blender's words for the platforms of extensions."""
    system, machine = sys.platform, platform.machine().lower()
    return f"{_SYSTEMS.get(system, system)}-{_MACHINES.get(machine, machine)}"


def complaint(blender, python=sys.version_info, here=None, made_for=MADE_FOR):
    """One sentence if another zip is the right one, else nothing.

    blender : its version, such as (4, 2, 0)
    python : (3, 11, …); here : the platform, as `this_platform` says it
    """
    if not made_for.is_file():  # a checkout
        return ""
    told = json.loads(made_for.read_text(encoding="utf-8"))
    here, running = here or this_platform(), "{}.{}".format(*python[:2])
    ours = next(z for z in told["zips"] if z["name"] == told["zip"])
    if (ours["platform"], ours["python"]) == (here, running) and list(blender) >= ours["first"]:
        return ""
    sentence = (
        f"This zip of Sketch to Face is for Blender {ours['blender']} on {ours['platform']}, with "
        f"Python {ours['python']}; for this one, Blender {blender[0]}.{blender[1]} on {here} with "
        f"Python {running}, "
    )
    for other in told["zips"]:
        fits = (other["platform"], other["python"]) == (here, running)
        if fits and other["first"] <= list(blender) < (other["beyond"] or [9999]):
            return f"{sentence}install {other['name']}."
    return f"{sentence}there is none: install Blender 4.2 or newer from blender.org."
