"""Which test programs execute which functions, from a build with GCC's --coverage.

GCC writes the functions of an object file, with their lines, to a .gcno file, and how often each
ran to a .gcda file (gcc/gcov-io.h of GCC 12; this module reads the records of functions and the
counters of their arcs, and skips the rest). `gcov` itself would take an hour for all programs.
"""

import concurrent.futures
import hashlib
import os
import pathlib
import shutil
import struct
import subprocess
from collections import defaultdict

import sandbox

BINARY = sandbox.FOLDER / "build" / "coverage"
COUNTERS = sandbox.FOLDER / "build" / "counters"  # one folder per test program
AT_ONCE = 2  # test programs
# Counters make some programs several times slower. Those that do not end in time count as programs
# that execute everything.
TIMEOUT_S = 60
# Early inlining would leave no counters of small functions. Threads may lose counts, but no count
# stays 0.
FLAGS = "-O2 -fno-early-inlining -DNDEBUG --coverage -fprofile-update=single"
_FUNCTION, _ARC_COUNTERS = 0x01000000, 0x01A10000


def _records(data, start):
    """Yields tag, offset and length [bytes] of each record. A negative length: all counters are 0,
    and the record has no content."""
    at = start
    while at + 8 <= len(data):
        tag, length = struct.unpack_from("<Ii", data, at)
        if tag == 0:
            return
        yield tag, at + 8, length
        at += 8 + max(length, 0)


def _text(data, at):
    length = struct.unpack_from("<I", data, at)[0]
    return data[at + 4 : at + 3 + length].decode(), at + 4 + length


def stamp_of(file):
    """Of the compilation; None if the file is gone."""
    return file.read_bytes()[8:12] if file.is_file() else None


def functions_of(gcno):
    """{ident: (source, first line, last line)} of an object file."""
    data = gcno.read_bytes()
    if data[:8] != b"oncg*22B":
        raise SystemExit(f"mutations: {gcno} is not of GCC 12")
    _, at = _text(data, 16)  # the working directory
    found = {}
    for tag, content, _ in _records(data, at + 4):
        if tag == _FUNCTION:
            ident = struct.unpack_from("<I", data, content)[0]
            _, at = _text(data, content + 12)  # the name
            source, at = _text(data, at + 4)
            first, _, last = struct.unpack_from("<III", data, at)
            found[ident] = (source, first, last)
    return found


def executed_in(gcda):
    """Idents of the functions that ran."""
    data, found, ident = gcda.read_bytes(), set(), 0
    for tag, content, length in _records(data, 16):
        if tag == _FUNCTION and length:
            ident = struct.unpack_from("<I", data, content)[0]
        elif tag == _ARC_COUNTERS and length > 0 and any(data[content : content + length]):
            found.add(ident)
    return found


class Coverage:
    """Programs by source (relative to `root`) and line, from `counters`/PROGRAM/**/*.gcda. Only
    programs that ended have a file `ended` in their folder. A program of which one object file was
    compiled anew since its run counts as one that executes everything."""

    def __init__(self, counters=COUNTERS, root=sandbox.FOLDER):
        self.functions = defaultdict(lambda: defaultdict(set))  # source, lines -> programs
        folders = sorted(f for f in counters.iterdir() if f.suffix != ".partial")
        self.unknown = {f.name for f in folders if not (f / "ended").is_file()}
        known = {}  # functions of each object file
        for folder in folders:
            for gcda in folder.rglob("*.gcda"):
                gcno = pathlib.Path("/", gcda.relative_to(folder)).with_suffix(".gcno")
                if stamp_of(gcda) != stamp_of(gcno):
                    self.unknown.add(folder.name)
                    continue
                if gcno not in known:
                    known[gcno] = functions_of(gcno)
                ran = executed_in(gcda)
                for ident, (source, first, last) in known[gcno].items():
                    source = os.path.normpath(gcno.parent / source)
                    if source.startswith(f"{root}/"):
                        programs = self.functions[os.path.relpath(source, root)][first, last]
                        programs |= {folder.name} if ident in ran else set()

    def programs(self, source, line):
        """Programs that execute the innermost function around the line (perhaps the function around
        a lambda); None if no function is around it, or if none executes it (perhaps the compiler
        evaluates it)."""
        around = [(lines, programs) for lines, programs in self.functions[source].items()
                  if lines[0] <= line <= lines[1]]
        if not around:
            return None
        first = max(lines[0] for lines, _ in around)
        executing = set().union(*(p for lines, p in around if lines[0] == first))
        return executing | self.unknown if executing else None


def _count(program):
    """Runs a test program, unless the same program ran before."""
    folder, binary = COUNTERS / program, BINARY / "bin" / program
    digest = hashlib.sha1(binary.read_bytes()).hexdigest()
    if (folder / "program").is_file() and (folder / "program").read_text() == digest:
        return
    print(f"mutations: what {program} executes", flush=True)
    partial = folder.with_suffix(".partial")
    for old in (partial, folder):
        shutil.rmtree(old, ignore_errors=True)
    partial.mkdir(parents=True)
    # A failed test is no reason to stop: under load, some rates are not held.
    result = subprocess.run(
        ["timeout", "--kill-after=10", str(TIMEOUT_S), binary], cwd=BINARY,
        env=sandbox.environment() | {"GCOV_PREFIX": str(partial)}, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    if result.returncode in (0, 1):  # GoogleTest's exit codes
        (partial / "ended").touch()
    (partial / "program").write_text(digest)
    partial.rename(folder)


def measure(programs):
    """Builds with counters and runs each test program. Keeps what an earlier call has measured."""
    environment = sandbox.environment()
    if subprocess.run(
        ["cmake", "-S", sandbox.FOLDER, "-B", BINARY, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=None",
         "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=0",
         f"-DCMAKE_CXX_FLAGS={FLAGS}", f"-DCMAKE_C_FLAGS={FLAGS}"],
        env=environment, stdout=subprocess.DEVNULL,
    ).returncode or subprocess.run(["ninja", "-C", BINARY], env=environment).returncode:
        raise SystemExit("mutations: the build with --coverage failed")
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        list(pool.map(_count, programs))
    return Coverage()
