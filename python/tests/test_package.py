from __future__ import annotations

import pathlib
import signal
import subprocess
import sys

import anchorsplat


def test_importing_takes_nothing_that_is_not_needed(python):
    done = python(
        "import sys, anchorsplat; print(sorted(m for m in sys.modules if m.split('.')[0] in "
        "('torch', 'tqdm', 'ray', 'fastapi', 'fsspec', 'IPython', 'matplotlib')))"
    )
    assert done.stdout == "[]\n", done.stderr


def test_the_version_is_the_programs(program):
    assert program("--version").stdout == f"anchorsplat {anchorsplat.__version__}\n"


def script(python, *words, **keywords):
    return python(f"import sys; from anchorsplat._program import main; sys.exit(main({list(map(str, words))!r}))", **keywords)


def test_the_console_script_is_the_native_program(python, biplane, program, tmp_path):
    assert script(python, "info", biplane, "--json").stdout == program("info", biplane, "--json").stdout
    missing = script(python, "info", tmp_path / "none.ply")
    assert missing.returncode == 3 and "no such file" in missing.stderr
    assert script(python, "--version").stdout == program("--version").stdout
    # Python ignores SIGPIPE, and what it starts would inherit that.
    package = pathlib.Path(anchorsplat.__file__).parents[1]
    main = f"import sys; sys.path.insert(0, {str(package)!r}); from anchorsplat._program import main; main(['manual', 'man'])"
    child = subprocess.Popen([sys.executable, "-c", main], stdout=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.close()
    assert child.wait() in (-signal.SIGPIPE, 6)


def test_the_native_program_says_where_python_verbs_come_from(program):
    for verb in ("serve", "batch"):
        said = program(verb, "--any", "thing", code=2).stderr
        assert f"pip install '.[{verb}]'" in said


def test_a_verb_whose_packages_are_missing_says_so(python):
    hide = "import sys; sys.modules.update(dict.fromkeys(['fastapi', 'uvicorn', 'ray', 'fsspec', 'prometheus_client'])); "
    for words in (["serve"], ["batch", "enhance", "a.ply", "--out", "b"]):
        verb = words[0]
        done = python(hide + f"from anchorsplat._program import main; sys.exit(main({words}))")
        assert done.returncode == 2, done.stderr
        assert f"pip install 'anchorsplat[{verb}]'" in done.stderr


def test_stubs_and_the_mark_of_types_are_there():
    package = pathlib.Path(anchorsplat.__file__).parent
    assert (package / "py.typed").exists()
    assert "class CameraSet" in (package / "_core.pyi").read_text()
