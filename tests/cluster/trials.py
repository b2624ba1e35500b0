#!/usr/bin/env python3
"""Trials as a HyperQueue job array: one task a shard, one table at the end.

Each task is `trials --case I/N --json-lines shard-I.jsonl`; when all are done `trials --collect` makes the table, which
is the one that a single process would print (the times aside). Needs the Python package hyperqueue, and the two
programs built: cargo build --release -p rig-tests -p host-sim --bins

  trials.py --shards 64 --server-dir ~/.hq-server --out DIR -- --rounds 4 --laws reserved --seeds-from-commit
  trials.py --shards 8 --local-workers 2 --out DIR -- --rounds 1
"""

import argparse
import contextlib
import pathlib
import subprocess
import sys

PROJECT = pathlib.Path(__file__).resolve().parents[2]


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--server-dir", type=pathlib.Path, help="folder of a running HyperQueue server (hq server start)")
    where.add_argument("--local-workers", type=int, metavar="N", help="start a server and N workers here, for this run")
    parser.add_argument("--shards", type=int, required=True, help="tasks to cut the cases into")
    parser.add_argument("--cores", type=int, default=1, help="cores of a task (default 1)")
    parser.add_argument("--programs", type=pathlib.Path, default=PROJECT / "target" / "release",
                        help="folder that holds trials and rig (default target/release)")
    parser.add_argument("--rig", type=pathlib.Path, help="the tool under trial, where it is not beside trials")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of the shards' lines and the table; shared by all nodes")
    parser.add_argument("options", nargs="*", metavar="OPTION", help="after --: options of rig trials")
    wanted = parser.parse_args(arguments)
    taken = {"--case", "--json-lines", "--collect", "--jobs", "--fit-coverage"}
    for option in wanted.options:
        if option.split("=")[0] in taken:
            parser.error(f"{option}: set by this script; allowed: the options of rig trials that choose cases")
    if wanted.shards < 1 or wanted.cores < 1 or (wanted.local_workers is not None and wanted.local_workers < 1):
        parser.error("--shards, --cores and --local-workers: at least 1")
    return wanted


@contextlib.contextmanager
def client_of(wanted):
    """A client of the server named, or of one that lives as long as the run."""
    from hyperqueue import Client
    from hyperqueue.cluster import LocalCluster, WorkerConfig

    if wanted.server_dir is not None:
        yield Client(wanted.server_dir)
        return
    with LocalCluster() as cluster:
        for _ in range(wanted.local_workers):
            cluster.start_worker(WorkerConfig(cores=wanted.cores))
        yield cluster.client()


def lines_of(wanted, index):
    return wanted.out / f"shard-{index:04}.jsonl"


def submit(wanted, trials, environment):
    from hyperqueue import Job
    from hyperqueue.ffi.protocol import ResourceRequest

    # A shard that fails does not stop the others: what is missing can be run again.
    job = Job(max_fails=None, name="rig trials")
    for index in range(1, wanted.shards + 1):
        lines = lines_of(wanted, index)
        if lines.exists():
            continue
        part = lines.with_suffix(".part")
        # The lines get their name only when they are complete.
        script = 'trials="$1"; part="$2"; lines="$3"; shift 3; "$trials" "$@" --json-lines "$part" && mv "$part" "$lines"'
        shard = [*wanted.options, "--case", f"{index}/{wanted.shards}"]
        job.program(
            ["sh", "-c", script, "sh", str(trials), str(part), str(lines), *shard],
            env=environment,
            stdout=str(lines.with_suffix(".stdout")),
            stderr=str(lines.with_suffix(".stderr")),
            name=f"shard {index}",
            resources=ResourceRequest(cpus=wanted.cores),
        )
    return job


def main(arguments):
    wanted = parse(arguments)
    trials = (wanted.programs / "trials").resolve()
    rig = (wanted.rig or wanted.programs / "rig").resolve()
    for program in (trials, rig):
        if not program.exists():
            sys.exit(f"{program}: not there; cargo build --release -p rig-tests -p host-sim --bins")
    try:
        import hyperqueue  # noqa: F401
    except ImportError:
        sys.exit("the Python package hyperqueue is not installed: pip install hyperqueue")
    wanted.out.mkdir(parents=True, exist_ok=True)
    wanted.out = wanted.out.resolve()
    environment = {"RIG_BIN": str(rig), "RAYON_NUM_THREADS": str(wanted.cores)}
    with client_of(wanted) as client:
        job = submit(wanted, trials, environment)
        if job.tasks:
            submitted = client.submit(job)
            client.wait_for_jobs([submitted], raise_on_error=False)
    shards = [lines_of(wanted, index) for index in range(1, wanted.shards + 1)]
    failed = [lines.stem for lines in shards if not lines.exists()]
    if failed:
        sys.exit(f"{wanted.out}: no lines of {', '.join(failed)}; their .stderr says why; run again to do these only")
    table = subprocess.run([trials, "--collect", *shards], check=True, capture_output=True, text=True).stdout
    (wanted.out / "table.txt").write_text(table)
    print(table, end="")


if __name__ == "__main__":
    main(sys.argv[1:])
