"""What ships is what the shell can import, found by following the imports in the sources.

Of our own modules every import counts, also those inside functions: a button may come by any of
them. Of a third-party module those count that happen whenever it is imported; what its authors put
into a function, an ``if`` or a ``try`` they can do without, and the test that presses every button
finds out whether we can, too.
"""

from __future__ import annotations

import ast
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from zipfile import ZipFile

PACKAGES = ("facs_rig", "classifiers", "snakes", "dataset_gen", "addon")
SHELL = "addon.blender"
# What every Blender has, with Python's own library.
BLENDER = frozenset({"numpy", "bpy", "bpy_extras", "bl_operators", "bl_ui", "bmesh", "mathutils",
                     "gpu", "gpu_extras", "blf", "freestyle", "addon_utils"})  # fmt: skip
# What our own modules ask for and work without, and why it does not ship.
OPTIONAL = {"numba": "draws lines faster by compiling; with LLVM it is larger than all the rest"}
CALLS = ("import_module", "__import__")  # functions that import
_STUB, _LAZY = ".pyi", "attach_stub"


class UnknownImport(Exception):
    """A module that ships imports something whose name cannot be read from the source."""


@dataclass(frozen=True)
class Module:
    """One module, of ours or of a wheel."""

    source: str | None  # None: compiled
    package: bool = False
    owner: str = ""  # file name of the wheel that it is in; empty for ours
    stub: str | None = None  # of a package: its __init__.pyi


@dataclass
class Reached:
    """What can be imported from the shell."""

    modules: dict[str, str] = field(default_factory=dict)  # name -> who imports it first
    foreign: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    # top-level name -> who imports it: all that are neither ours, nor in a wheel, nor Python's


@cache
def own_modules(root: Path) -> dict[str, Module]:
    """Every module of the checkout `root` that the add-on may be made of, by its full name."""
    found = {}
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            stub = path.with_suffix(_STUB)
            text = stub.read_text(encoding="utf-8") if stub.is_file() else None
            name = path.relative_to(root).as_posix()
            found[module_name(name)] = Module(
                path.read_text(encoding="utf-8"), path.name == "__init__.py", "", text
            )
    return found


@cache
def wheel_modules(wheel: Path) -> dict[str, Module]:
    """Every module in a wheel, by its full name; tests left out."""
    found: dict[str, Module] = {}
    with ZipFile(wheel) as archive:
        names = archive.namelist()
        stubs = {n for n in names if n.endswith("/__init__" + _STUB)}
        for name in names:
            if "/tests/" in name or ".dist-info/" in name:
                continue
            if name.endswith(".py"):
                stub = archive.read(name + "i").decode() if name + "i" in stubs else None
                source = archive.read(name).decode()
                module = Module(source, name.endswith("/__init__.py"), wheel.name, stub)
                found[module_name(name)] = module
            elif name.endswith((".so", ".pyd")):
                folder, _, file = name.rpartition("/")
                compiled = f"{folder}/{file.partition('.')[0]}.py"
                found.setdefault(module_name(compiled), Module(None, False, wheel.name))
    return found


def module_name(path: str) -> str:
    """The full name of a module whose file is at `path`, with slashes, below the import path."""
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def reached(root: Path, wheels: Iterable[Path] = ()) -> Reached:
    """Follow the imports from every module of the shell; into `wheels` as well.

    Raises UnknownImport where a module of ours computes the name of what it imports.
    """
    modules = dict(own_modules(root))
    for wheel in wheels:
        modules |= wheel_modules(wheel)
    shell = [n for n in modules if n == SHELL or n.startswith(SHELL + ".")]
    told = Reached(dict.fromkeys(shell, ""))
    todo = list(shell)
    while todo:
        name = todo.pop()
        for target in _imports(name, modules):
            parents = [target.rsplit(".", n)[0] for n in range(target.count("."), -1, -1)]
            known = [p for p in parents if p in modules]
            if not known and parents[0] not in sys.stdlib_module_names:
                told.foreign[parents[0]].add(name)
            new = [p for p in known if p not in told.modules]
            told.modules |= dict.fromkeys(new, name)
            todo += new
    return told


def needed(root: Path, wheels: Iterable[Path]) -> tuple[list[Path], dict[str, set[str]]]:
    """Those of `wheels` that the shell can import from; and what is not in them.

    The second: top-level name -> who imports it, without what Blender has and what is OPTIONAL.
    """
    wheels = list(wheels)
    told = reached(root, wheels)
    owners = {module.owner for wheel in wheels for name, module in wheel_modules(wheel).items()
              if name in told.modules}  # fmt: skip
    lacking = {n: who for n, who in told.foreign.items() if n not in BLENDER | OPTIONAL.keys()}
    return [wheel for wheel in wheels if wheel.name in owners], lacking


def _imports(name: str, modules: Mapping[str, Module]) -> Iterator[str]:
    """Full names of what a module imports; of ``from x import y`` both, ``x`` and ``x.y``."""
    module = modules[name]
    if module.source is None:
        return
    ours = not module.owner
    for text in (module.source, module.stub if ours else None):
        for node in _import_nodes(name, text or "", ours):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                base = _base(name, module.package, node)
                yield base
                for alias in node.names:
                    yield from _named(base, alias.name, modules)
            else:
                yield _dynamic(name, node)


@cache
def _import_nodes(name: str, text: str, deep: bool) -> list[ast.stmt | ast.Call]:
    """The import statements of a source, and if `deep` also the calls that import.

    Not `deep` are those alone that are carried out whenever the module is.
    """
    found: list[ast.stmt | ast.Call] = []

    def walk(node: ast.AST) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import | ast.ImportFrom):
                found.append(child)
            elif deep:
                if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                    continue
                if isinstance(child, ast.Call) and _called(child) in CALLS:
                    found.append(child)
                walk(child)
            elif isinstance(child, ast.ClassDef | ast.With):
                walk(child)

    walk(ast.parse(text, name))
    return found


def _called(call: ast.Call) -> str:
    return ast.unparse(call.func).rpartition(".")[2]


def _dynamic(name: str, node: ast.AST) -> str:
    """The module that a call of `import_module` names."""
    arguments = getattr(node, "args", [])
    if arguments and isinstance(arguments[0], ast.Constant) and isinstance(arguments[0].value, str):
        return arguments[0].value
    raise UnknownImport(
        f"{name} imports by a name that it computes ({ast.unparse(node)}), so that nobody can know "
        "what has to be in the zip: write the import out."
    )


def _base(name: str, package: bool, node: ast.ImportFrom) -> str:
    """The full name of `x` in ``from x import y``, with the dots of a relative import resolved."""
    if not node.level:
        return node.module or ""
    parts = name.split(".")
    parts = parts[: len(parts) - node.level + package]
    return ".".join(parts + ([node.module] if node.module else []))


def _named(base: str, name: str, modules: Mapping[str, Module]) -> Iterator[str]:
    """The module that ``from base import name`` brings: a sub-module, or where a stub has it from.

    A package that is loaded lazily (lazy_loader's ``attach_stub``) imports what it is asked for.
    """
    if f"{base}.{name}" in modules:
        yield f"{base}.{name}"
        return
    module = modules.get(base)
    if module is None or module.stub is None or _LAZY not in (module.source or ""):
        return
    there, its_name = _offered(base, module.stub).get(name, ("", ""))
    if there:
        yield there
        yield from _named(there, its_name, modules)


@cache
def _offered(package: str, stub: str) -> dict[str, tuple[str, str]]:
    """What a package's stub offers: name -> the module that has it, and its name there."""
    return {
        alias.asname or alias.name: (_base(package, True, node), alias.name)
        for node in ast.walk(ast.parse(stub))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
