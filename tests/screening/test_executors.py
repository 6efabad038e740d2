"""Many workers: the same rows from processes and from dask, with kills in the middle."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import warnings
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from scripted import greedy, same, screening, slow, three

from flybystab.errors import FlybystabWarning, InvalidInput, WorkersLost
from flybystab.screening import executors
from flybystab.screening.classification import classification
from flybystab.screening.executors import open_executor
from flybystab.screening.results import read_results

HERE = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    path = tmp_path_factory.mktemp("reference") / "r.ecsv"
    screening(16, three, samples=3, seed=4).run(path)
    return read_results(path)


def wait_for(condition, seconds=600.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


def lines(journal):
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    # killed, and its exit status has not been read yet
    return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z" if Path("/proc").is_dir() else True


def test_processes_give_the_same_rows(tmp_path, reference):
    with open_executor(2) as pool:
        screening(16, three, samples=3, seed=4).run(tmp_path / "p.ecsv", executor=pool)
    same(read_results(tmp_path / "p.ecsv"), reference)


def test_dead_process_is_named_and_the_run_goes_on(tmp_path, reference):
    def kill(state):
        if state.done == 4:
            os.kill(next(iter(pool._processes)), signal.SIGKILL)

    run = screening(16, three, samples=3, seed=4)
    with open_executor(2) as pool, pytest.raises(WorkersLost, match="in progress"):
        run.run(tmp_path / "p.ecsv", executor=pool, chunk=1, progress=kill)
    assert not read_results(tmp_path / "p.ecsv").meta["complete"]
    states = []
    with open_executor(1) as pool:
        run.run(tmp_path / "p.ecsv", executor=pool, progress=states.append)
    assert states[0].resumed >= 4
    same(read_results(tmp_path / "p.ecsv"), reference)


def test_dead_processes_found_at_the_next_call_are_named(tmp_path, reference):
    """The pool then refuses the next call instead of failing one in progress."""

    def kill(state):
        if state.done == 4:
            os.kill(next(iter(pool._processes)), signal.SIGKILL)
            wait_for(lambda: pool._broken)

    run = screening(16, three, samples=3, seed=4)
    with open_executor(2) as pool, pytest.raises(WorkersLost, match=r"BrokenProcessPool.*in progress: \w"):
        run.run(tmp_path / "p.ecsv", executor=pool, chunk=1, progress=kill)
    states = []
    run.run(tmp_path / "p.ecsv", progress=states.append)
    assert 4 <= states[0].resumed < 16
    same(read_results(tmp_path / "p.ecsv"), reference)


def test_calls_that_an_executor_refuses_for_other_reasons_keep_their_error(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        pass
    with pytest.raises(RuntimeError, match="after shutdown") as caught:
        screening(3).run(tmp_path / "p.ecsv", executor=pool)
    assert not isinstance(caught.value, WorkersLost)


def test_ctrl_c_leaves_a_valid_file(tmp_path, reference):
    out, hold = tmp_path / "c.ecsv", tmp_path / "hold"
    run = subprocess.Popen(
        [sys.executable, HERE / "scripted.py", out, "2"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env=os.environ | {"HOLD": str(hold)},
    )
    wait_for(lambda: lines(tmp_path / "c.ecsv.journal") > 5)
    os.killpg(run.pid, signal.SIGINT)  # as a terminal does: to all processes
    hold.touch()
    _, said = run.communicate(timeout=600)
    assert run.returncode != 0
    assert said.count("KeyboardInterrupt") == 1
    part = read_results(out)
    assert not part.meta["complete"]
    assert 0 < len(part) < len(reference)
    screening(16, slow, samples=3, seed=4).run(out)
    same(read_results(out), reference)


@pytest.mark.parametrize("pause", [0.0, 0.05, 0.3])
def test_a_second_ctrl_c_ends_a_run_at_once_and_nothing_is_lost(tmp_path, reference, pause):
    out = tmp_path / "c.ecsv"
    run = subprocess.Popen(
        [sys.executable, HERE / "scripted.py", out, "2"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env=os.environ | {"HOLD": str(tmp_path / "never")},
    )
    wait_for(lambda: lines(tmp_path / "c.ecsv.journal") > 5)
    for _ in range(2):
        os.killpg(run.pid, signal.SIGINT)
        time.sleep(pause)
    _, said = run.communicate(timeout=600)  # the workers wait for a file that never comes
    assert run.returncode != 0
    # No traceback of a worker. That of the parent may name multiprocessing, where the second signal meets its exit.
    assert not re.search("SpawnProcess|spawn_main", said), said
    screening(16, slow, samples=3, seed=4).run(out)
    same(read_results(out), reference)


def test_workers_end_with_a_killed_parent(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    environment = os.environ | {"MARKS": str(marks), "HOLD": str(tmp_path / "never")}
    run = subprocess.Popen([sys.executable, HERE / "scripted.py", tmp_path / "o.ecsv", "2"], env=environment)
    wait_for(lambda: lines(tmp_path / "o.ecsv.journal") > 10 and len(list(marks.iterdir())) == 2)
    pids = [int(f.name) for f in marks.iterdir()]
    assert run.pid not in pids
    run.kill()
    run.wait()
    wait_for(lambda: not any(map(alive, pids)))


def test_workers_are_checked():
    with pytest.raises(InvalidInput, match="workers"), open_executor(0):
        pass


def refused_scheduler(where, error, text, timeout=1):
    """Connecting ends in a named error within the time limit."""
    pytest.importorskip("distributed")
    began = time.monotonic()
    with pytest.raises(error, match=text), open_executor(dask=str(where), timeout=timeout):
        pass
    # distributed itself may wait without end; the rest is for a machine that is busy
    assert time.monotonic() - began < timeout + 300


@pytest.mark.parametrize(
    ("where", "text"),
    [
        ("tcp://127.0.0.1:9", "no dask scheduler answers at tcp://127.0.0.1:9"),
        ("127.0.0.1", "missing port"),
        ("nonsense://127.0.0.1:9", "unknown address scheme"),
        ("tls://127.0.0.1:9", "tls needs certificates: distributed.comm.tls.ca-file"),
    ],
)
def test_a_dask_scheduler_that_does_not_answer_is_named(where, text):
    refused_scheduler(where, WorkersLost, text)
    refused_scheduler(
        where, WorkersLost, "Nothing was computed; results of an earlier, unfinished run are kept"
    )


@pytest.mark.parametrize(
    ("reply", "text"),
    [
        (b"", "no answer within 1 s"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "no dask scheduler"),
        (bytes(64), "no dask"),
    ],
)
def test_a_server_that_is_no_dask_scheduler_is_named_within_the_time_limit(reply, text):
    with socket.create_server(("127.0.0.1", 0)) as server:
        held = []

        def serve():
            with suppress(OSError):  # closed at the end of the test
                while True:
                    held.append(server.accept()[0])
                    held[-1].sendall(reply)

        threading.Thread(target=serve, daemon=True).start()
        refused_scheduler(f"tcp://127.0.0.1:{server.getsockname()[1]}", WorkersLost, text)


@pytest.mark.parametrize(
    ("content", "error", "text"),
    [
        (None, WorkersLost, "does not exist: start the scheduler first"),
        ("", InvalidInput, "a JSON document"),
        ("{}", InvalidInput, 'the "address" of the scheduler'),
        ('{"address": 3}', InvalidInput, 'the "address" of the scheduler'),
        ("[" * 1000, InvalidInput, "nested at most"),
        ('{"address": "tcp://127.0.0.1:9"}', WorkersLost, "no dask scheduler answers"),
    ],
)
def test_a_wrong_dask_scheduler_file_is_named(tmp_path, content, error, text):
    file = tmp_path / "scheduler.json"
    if content is not None:
        file.write_text(content)
    refused_scheduler(file, error, text)


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """A function that starts a dask cluster on this machine: one worker of one thread, which is not started again."""
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")]))
    stack = ExitStack()
    stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 0}))

    def start(workers=1, memory="2GB"):
        return stack.enter_context(
            distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1", memory_limit=memory,
                dashboard_address=None, silence_logs=50, local_directory=str(tmp_path / "dask"),
            )
        )  # fmt: skip

    with stack:
        yield start


@pytest.mark.slow
def test_dask_workers_out_of_memory_are_named_and_the_run_goes_on(tmp_path, reference, cluster):
    out = tmp_path / "d.ecsv"
    with (
        open_executor(dask=cluster(memory="1GB").scheduler_address) as executor,
        pytest.raises(WorkersLost, match=r"too little memory.*KilledWorker.*the same call continues the run"),
    ):
        screening(16, greedy, samples=3, seed=4).run(out, executor=executor, chunk=1)
    done = len(lines_of_tasks(out))
    states = []
    screening(16, three, samples=3, seed=4).run(out, progress=states.append)
    assert states[0].resumed == done > 0
    same(read_results(out), reference)


def lines_of_tasks(out):
    """Records of finished tasks in the journal of a run."""
    journal = out.with_name(out.name + ".journal")
    return [
        line
        for line in journal.read_bytes().splitlines()
        if line.startswith(b'{"task"') and b'"first"' not in line
    ]


@pytest.mark.slow
def test_dask_workers_without_the_package_and_schedulers_without_workers_are_named(
    tmp_path, cluster, monkeypatch
):
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    (hidden / "sitecustomize.py").write_text(
        "import sys\n\n\nclass Hide:\n    def find_spec(self, name, path=None, target=None):\n"
        "        if name.partition('.')[0] == 'flybystab':\n            raise ModuleNotFoundError(name)\n\n\n"
        "sys.meta_path.insert(0, Hide())\n"
    )
    address = cluster(workers=0).scheduler_address
    with pytest.warns(FlybystabWarning, match="has no workers"), open_executor(dask=address):
        pass
    worker = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny",
         "--no-dashboard", "--local-directory", tmp_path / "w"],
        env=os.environ | {"PYTHONPATH": str(hidden)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FlybystabWarning)  # the worker may not have connected yet
            with (
                open_executor(dask=address) as executor,
                pytest.raises(WorkersLost, match=r"same version of flybystab .*; in progress: "),
            ):
                screening(3).run(tmp_path / "d.ecsv", executor=executor)
    finally:
        worker.kill()
        worker.wait()


@pytest.mark.parametrize("suffix", ["ecsv", "parquet"])
def test_killed_run_resumes_without_losing_or_repeating_a_row(tmp_path, reference, monkeypatch, suffix):
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    out, marks = tmp_path / f"k.{suffix}", tmp_path / "marks"
    marks.mkdir()
    environment = os.environ | {"MARKS": str(marks), "HOLD": str(tmp_path / "never"), "ROW_GROUP": "4"}
    journal = tmp_path / f"k.{suffix}.journal"
    run = subprocess.Popen([sys.executable, HERE / "scripted.py", out], env=environment)
    wait_for(lambda: lines(journal) > 5)
    run.send_signal(signal.SIGKILL)
    run.wait()
    assert not out.exists()
    assert (tmp_path / f"k.{suffix}.part").stat().st_size > 0  # row groups, or rows, without an end
    assert 5 <= lines(journal) - 1 <= 10
    monkeypatch.setenv("MARKS", str(marks))
    screening(16, slow, samples=3, seed=4).run(out)
    same(read_results(out), reference)
    assert [f.name for f in tmp_path.iterdir() if f.is_file()] == [out.name]
    computed = Counter(line for f in marks.iterdir() for line in f.read_text().split("\n") if line)
    assert len(computed) == 16
    # Only the asteroid in work when the run was killed may have been begun twice.
    assert sum(computed.values()) <= 17


@pytest.fixture
def dask_processes(tmp_path):
    """A function that starts a dask scheduler and workers of one thread as processes: scheduler, workers, file.

    All of them end with the test.
    """
    pytest.importorskip("distributed")
    file, started = tmp_path / "scheduler.json", []

    def start(workers, **variables):
        environment = os.environ | variables
        environment["PYTHONPATH"] = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])

        def process(name, *arguments):
            command = [sys.executable, "-m", f"distributed.cli.{name}", "--scheduler-file", file, *arguments]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen([*command, "--no-dashboard"], env=environment, **quiet))

        process("dask_scheduler", "--host", "127.0.0.1", "--port", "0")
        wait_for(file.exists)
        for k in range(workers):
            process("dask_worker", "--nthreads", "1", "--no-nanny", "--local-directory", tmp_path / f"w{k}")
        return started[0], started[1:], file

    try:
        yield start
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_dask_with_a_killed_worker_gives_the_same_rows(tmp_path, reference, dask_processes):
    distributed = pytest.importorskip("distributed")
    marks, hold = tmp_path / "marks", tmp_path / "hold"
    marks.mkdir()
    _, workers, address = dask_processes(
        2, MARKS=str(marks), HOLD=str(hold), DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="10"
    )
    with distributed.Client(scheduler_file=str(address), timeout=600) as client:
        client.wait_for_workers(2, timeout=600)

        def kill():
            wait_for(lambda: lines(tmp_path / "d.ecsv.journal") > 4 and len(list(marks.iterdir())) == 2)
            workers[0].kill()
            workers[0].wait()
            hold.touch()

        killer = threading.Thread(target=kill)
        killer.start()
        run = screening(16, slow, samples=3, seed=4)
        run.run(tmp_path / "d.ecsv", executor=client.get_executor(), chunk=1)
        killer.join()
    assert workers[0].poll() is not None
    same(read_results(tmp_path / "d.ecsv"), reference)


# the worker may not have connected yet
@pytest.mark.filterwarnings("ignore:the dask scheduler .* has no workers")
def test_a_dask_scheduler_that_is_killed_is_named_and_the_run_goes_on(tmp_path, reference, dask_processes):
    """It is killed while the worker waits in the eleventh asteroid, so that calls are certainly in progress."""
    out, marks = tmp_path / "d.ecsv", tmp_path / "marks"
    marks.mkdir()
    scheduler, _, address = dask_processes(1, MARKS=str(marks), HOLD=str(tmp_path / "never"))

    def kill():
        wait_for(lambda: "copy 10" in "".join(f.read_text() for f in marks.iterdir()))
        wait_for(lambda: lines(out.with_name("d.ecsv.journal")) > 5)
        scheduler.kill()

    killer = threading.Thread(target=kill)
    killer.start()
    with (
        open_executor(dask=str(address)) as executor,
        pytest.raises(
            WorkersLost, match=r"workers died or were lost .*in progress: .*the same call continues"
        ),
    ):
        screening(16, slow, samples=3, seed=4).run(out, executor=executor, chunk=1)
    killer.join()
    part = read_results(out)
    assert not part.meta["complete"]
    assert 0 < len(part) < len(reference)
    states = []
    screening(16, three, samples=3, seed=4).run(out, progress=states.append)
    assert 5 <= states[0].resumed <= 10
    same(read_results(out), reference)


def test_old_names_of_the_number_of_workers_are_deprecated():
    with pytest.warns(DeprecationWarning, match="use open_executor"), executors.workers(jobs=1) as pool:
        assert pool is None
    with pytest.warns(DeprecationWarning, match="use workers"):
        old = classification(["Anteros"], threads=1)
    same(old, classification(["Anteros"], workers=1))
