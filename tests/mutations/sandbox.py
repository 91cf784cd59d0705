"""A copy of the checkout in build/mutations, in which mutants are built and tested.

The checkout itself is never changed, so that an interrupted run leaves nothing behind.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass

from mutants import ROOT, applied

FOLDER = ROOT / "build" / "mutations"
BINARY = FOLDER / "build" / "release"
# A mutant of a header that almost every source includes takes minutes to build.
MAX_COMPILATIONS = 25
# These start processes of the product.
PROCESS_TESTS = re.compile(
    r"^(pipeline|launch|hostile_peer|idle_nodes|(capture|recon|sim|render)_node_)"
)


class DoesNotCompile(Exception):
    pass


class TooManyCompilations(Exception):
    """Raised before anything is built."""


class SameObjectCode(Exception):
    pass


@dataclass
class Failure:
    program: str
    test: str  # a GoogleTest filter, or a regular expression for ctest if `program` is "ctest"


def lock():
    """Ends this program if another one works on the copy, and would test this one's mutants."""
    FOLDER.parent.mkdir(parents=True, exist_ok=True)
    lock.file = open(FOLDER.with_suffix(".lock"), "w")  # is released when this program ends
    try:
        fcntl.flock(lock.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SystemExit(
            f"mutations: another mutation test uses {FOLDER}; wait for its end") from None


def sync():
    """Copies the files that git tracks or would track, and removes those that are gone."""
    lock()
    listing = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT, check=True,
        capture_output=True, text=True,
    ).stdout
    wanted = {f for f in listing.split("\0") if f and (ROOT / f).is_file()}
    FOLDER.mkdir(parents=True, exist_ok=True)
    for path in list(FOLDER.rglob("*")):
        relative = path.relative_to(FOLDER)
        if relative.parts[0] in ("build", "out") or path.is_dir():
            continue
        if str(relative) not in wanted:
            path.unlink()
    for file in wanted:
        source, copy = ROOT / file, FOLDER / file
        if copy.is_file() and copy.read_bytes() == source.read_bytes():
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copy)  # with a new modification time, so that the build sees it


def environment():
    return os.environ | {
        "FIVEPIPE_WERROR": "0",  # a dropped statement may leave a variable unused
        "LP_NUM_THREADS": os.environ.get("LP_NUM_THREADS", "1"),
        "CCACHE_DEPEND": "1",
        "CCACHE_SLOPPINESS": "pch_defines,time_macros,include_file_mtime,include_file_ctime",
    }


def configure():
    """Configures the copy and brings the programs of the nodes up to date."""
    if subprocess.run(
        [FOLDER / "launch/build", "release", "--target", "demo"], env=environment()
    ).returncode:
        raise SystemExit("mutations: the copy of the checkout does not build")


def ninja(*arguments):
    return subprocess.run(
        ["ninja", "-C", BINARY, *arguments], capture_output=True, text=True, env=environment()
    )


def build(*targets):
    result = ninja("-j", str(os.cpu_count()), *targets)
    if result.returncode:
        raise DoesNotCompile(result.stdout[-4000:])


def build_without_mutant(*targets):
    try:
        build(*targets)
    except DoesNotCompile as error:
        raise SystemExit(f"mutations: the copy does not build without a mutant:\n{error}") from None


class Tests:
    """The test programs, and the tests of the shaders, which are no GoogleTest program."""

    def __init__(self):
        listing = subprocess.run(
            ["ctest", "--show-only=json-v1", "-LE", "long"], cwd=BINARY, capture_output=True,
            text=True, check=True, env=environment(),
        ).stdout
        self.programs, self.shaders = {}, []
        for test in json.loads(listing)["tests"]:
            command = test.get("command", [""])
            if any(argument.startswith("--gtest_filter=") for argument in command):
                self.programs.setdefault(pathlib.Path(command[0]).name, []).append(test["name"])
            elif test["name"].startswith("Shaders."):
                self.shaders.append(test["name"])
        # All inputs, also those of the nodes that a test starts.
        self.inputs = {program: set(ninja("-t", "inputs", f"bin/{program}").stdout.split())
                       for program in self.programs}

    def affected(self, objects):
        """Test programs of which one of the object files is part."""
        return [p for p in self.programs if not self.inputs[p].isdisjoint(objects)]


@contextlib.contextmanager
def mutated(mutant):
    """The copy holds the mutant inside of the `with` block. A mutant that was not built leaves no
    trace: with a newer source, the next build would compile all that includes it."""
    path = FOLDER / mutant.file
    original, before = path.read_text(), path.stat()
    path.write_text(applied(mutant, original))
    try:
        yield
    except TooManyCompilations:
        path.write_text(original)
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
        raise
    finally:
        if path.read_text() != original:
            path.write_text(original)


def plan():
    """Object files that a build of everything would compile. The build always writes the version
    first, so the object file with it is among them."""
    return re.findall(r"Building CX?X? object (\S+)", ninja("-n", "all").stdout)


def hashes(objects):
    return {o: hashlib.sha1((BINARY / o).read_bytes()).digest() for o in objects
            if (BINARY / o).is_file()}


def run(program, test_filter, timeout_s):
    """Runs a test program up to its first failure. Returns the failed test, or None."""
    if program == "ctest":
        result = subprocess.run(
            ["ctest", "-R", test_filter, "--no-tests=error", "--timeout", str(timeout_s)],
            cwd=BINARY, capture_output=True, text=True, env=environment(),
        )
        return test_filter if result.returncode else None
    command = [BINARY / "bin" / program, "--gtest_fail_fast", f"--gtest_filter={test_filter}"]
    # In its own process group, so that a test that hangs or crashes ends together with its children
    # (those of `fivepipe up` end with it).
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
        env=environment(), start_new_session=True, cwd=BINARY,
    )
    try:
        output, _ = process.communicate(timeout=timeout_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        output, _ = process.communicate()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    if process.returncode == 0:
        return None
    return failed_test(output) or test_filter


def has_test(program, test):
    listing = subprocess.run(
        [BINARY / "bin" / program, "--gtest_list_tests", f"--gtest_filter={test}"], cwd=BINARY,
        capture_output=True, text=True, check=True, env=environment(),
    ).stdout
    return "\n  " in listing


def failed_test(output):
    """The first failed test that GoogleTest names, otherwise the last one that it started."""
    failed = re.findall(r"^\[  FAILED  \] ([\w/]+\.[\w/]+)", output, re.M)
    started = re.findall(r"^\[ RUN      \] ([\w/]+\.[\w/]+)", output, re.M)
    return failed[0] if failed else started[-1] if started else None


class Durations:
    """How long each test program takes without a fault; kept between runs."""

    path = FOLDER / "build" / "durations.json"

    def __init__(self):
        self.seconds = json.loads(self.path.read_text()) if self.path.is_file() else {}

    def measure(self, program):
        start = time.monotonic()
        failed = run(program, "*", 600)
        if failed:
            raise SystemExit(f"mutations: {program}: {failed} fails without a mutant")
        self.seconds[program] = time.monotonic() - start
        self.path.write_text(json.dumps(self.seconds, indent=1))

    def timeout_s(self, program):
        return timeout_s(self.seconds.get(program, 20))


def timeout_s(usual_s):
    """A mutant that hangs fails after 20 s and five times the usual duration."""
    return 20 + 5 * usual_s
