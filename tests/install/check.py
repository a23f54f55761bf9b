"""check.py BUILD: `cmake --install` of that build into an empty folder gives a posed that works from there.

The commands find their configs and page below the new prefix, the manual pages have every command and option of
`--help`, and a C++ and a Python client are made of what is installed alone.
"""

import gzip
import json
import os
import re
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

ROFF = {r"\(rs": "\\", r"\-": "-", r"\(aq": "'", r"\(ga": "`", r"\(ha": "^", r"\(ti": "~", r"\&": ""}


def output(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120, **options).stdout


def plain(page):
    """The text of a manual page without groff's escapes, its blanks as single ones."""
    text = re.sub(r"\\(\((rs|aq|ga|ha|ti)|[-&])", lambda match: ROFF[match.group(0)], page)
    return " ".join(text.split())


def entries(text, heading):
    """The words of --help before the descriptions of a list: names of commands, or options with their types."""
    block = text.partition(f"\n{heading}:\n")[2].partition("\n\n")[0]
    return [re.split(r"\s{2,}", line.strip())[0] for line in block.splitlines() if re.match(r"  \S", line)]


def check_manual(posed, pages, path=()):
    """Every command and option of --help of `path` and what is below it; returns how many options there are."""
    text = output(posed, *path, "--help")
    page = plain(gzip.open(pages / ("-".join(["posed", *path[:1]]) + ".1.gz"), "rt").read())
    options = entries(text, "Options") + entries(text, "Positionals")
    assert options, f"--help of {path} has no options"
    for option in options:
        assert option in page, f"the manual page of {path} lacks {option!r}"
    commands = entries(text, "Subcommands")
    for command in commands:
        assert path or f"posed-{command} (1)" in page, f"posed(1) does not name {command}"
        assert not path or " ".join(["posed", *path, command]) in page, f"{path}: its page lacks {command}"
        options += check_manual(posed, pages, (*path, command))
    return options


def check_warnings(pages):
    for page in sorted(pages.glob("posed*.1.gz")):
        said = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", page], check=True,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                              env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "80"}).stderr
        assert not said, f"{page.name}: {said}"


def check_page(posed, prefix):
    """`posed view` without --page serves the page beside the program, not the one of the source tree."""
    page = prefix / "share/posed/viewer/index.html"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text("<p>the installed page")
    view = subprocess.Popen([posed, "view", "--connect", "tcp://127.0.0.1:9", "--port", "0", "--json"],
                            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        url = json.loads(view.stdout.readline())["url"]
        local = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        assert local.open(url, timeout=30).read() == b"<p>the installed page"
    finally:
        view.kill()
        view.wait()


def check_clients(prefix, folder):
    source = folder / "client.cpp"
    source.write_text("#include <posed/posed_client.hpp>\n#include <cstdio>\n"
                      'int main() { posed_client::Keys keys; posed::v1::Frame frame; frame.set_sequence(1);\n'
                      "std::puts(frame.GetTypeName().c_str()); }\n")
    found = next(prefix.glob("lib/**/posed.pc")).parent
    flags = output("pkg-config", "--cflags", "--libs", "posed",
                   env={**os.environ, "PKG_CONFIG_PATH": str(found)}).split()
    output("c++", "-std=c++17", "-O0", str(source), *flags, "-o", str(folder / "client"))
    assert output(folder / "client").strip() == "posed.v1.Frame"
    python = next(prefix.glob("lib/python3*/**/posed/__init__.py")).parent.parent
    # Debian's own, for which `run` installs the packages of zmq and protobuf.
    output("/usr/bin/python3", "-c", "import posed; from posed.v1 import posed_pb2; posed.Client; posed_pb2.Frame()",
           env={**os.environ, "PYTHONPATH": str(python), "PYTHONDONTWRITEBYTECODE": "1"})


def main(build):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prefix = folder / "usr"
        for component in ("posed", "dev", "python"):
            output("cmake", "--install", build, "--prefix", prefix, "--component", component)
        posed = prefix / "bin/posed"
        pages = prefix / "share/man/man1"
        options = check_manual(posed, pages)
        assert len(options) > 200, options
        check_warnings(pages)
        config = prefix / "share/posed/config"
        checked = subprocess.run([posed, "check", "--json", "--config", config / "posed.toml"], capture_output=True)
        # Of all that it shows only the clip is not there, which every user has to name.
        errors = json.loads(checked.stdout)["errors"]
        assert [error["file"] for error in errors] == [str(config / "walk.bvh")], errors
        for path in ("lib/udev/rules.d/70-posed.rules", "share/bash-completion/completions/posed",
                     "share/zsh/vendor-completions/_posed", "share/fish/vendor_completions.d/posed.fish",
                     "share/posed/config/stage/capture.toml", "share/posed/config/metrics/alerts.yml",
                     "share/posed/config/metrics/dashboard.json", "share/posed/proto/posed/v1/posed.proto"):
            assert (prefix / path).stat().st_size > 0, path
        # What reads FBX is a program of its own.
        output(posed, "convert", Path(__file__).parents[1] / "golden/fbx/arm.fbx", "--out", folder / "arm.bvh")
        check_page(posed, prefix)
        check_clients(prefix, folder)
        print(f"{len(options)} options in {len(list(pages.glob('*')))} manual pages")


main(sys.argv[1])
