#!/usr/bin/env python3
"""many.py BUILD ROBOTS DRIVES [DIRECTORY]: a fleet of simulated robots, whose rows are loaded and reported on.

Robot i has the i-th task of config/drive, beginning again behind the last, and drives in simulated time, of seeds that no
other robot has. Each declares something else, a tenth of them too little; a third has errors of measurement, a seventh wears
out, and a twentieth is in shadow mode. Prints rows, times, sizes and memory, and fails if a row is missing or there twice.
DIRECTORY, which others may enter, keeps the rows: a robot that has driven does not drive again. docs/fleet.md has figures.
"""
import os
import pathlib
import re
import resource
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from multiprocessing.pool import ThreadPool

source = pathlib.Path(__file__).resolve().parents[2]
build = pathlib.Path(sys.argv[1]).resolve()
robots, drives = map(int, sys.argv[2:4])
tasks = sorted((source / 'config/drive').glob('*.yaml'))
tables = ['decisions', 'execution_events', 'gaps', 'transitions']
programs = sorted(pathlib.Path('/usr/lib/postgresql').glob('*/bin'))
as_nobody = [source / 'tests/fleet/as_nobody'] if os.geteuid() == 0 else []
if not programs or subprocess.run([*as_nobody, 'true'], stderr=subprocess.DEVNULL).returncode != 0:
    print('PostgreSQL is not installed, or refuses root: (Skipped)')
    sys.exit(77)


def start(*command, out=subprocess.PIPE):
    return subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT, text=True)


def end(process, codes=(0,)):
    """What it printed, and the largest memory of it or of a child, MiB."""
    out = process.stdout.read() if process.stdout else ''
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode in codes, (process.args, out)
    return out, usage.ru_maxrss / 1024


def run(*command, codes=(0,)):
    return end(start(*command), codes)


def task_of(robot):
    path = tasks[robot % len(tasks)]
    text = path.read_text().replace('file: ../', f'file: {source}/config/')
    text = re.sub('(?m)^transitions: ', f'transitions: {path.parent}/', text)
    shadow, bold = robot % 20 == 19, robot % 10 == 3
    factor = 0.5 if bold else 1 + robot / robots / 5
    text = re.sub('time_limit_s: .*', f'time_limit_s: {0.5 if shadow or bold else 20}', text)  # one that is refused does not drive
    text = re.sub('lipschitz: .*', lambda line: re.sub(r'\d[\d.]*(?=[,}])', lambda x: f'{factor * float(x[0]):.9g}', line[0]), text)
    return text.replace('gate: {', 'gate: {mode: shadow, ') if shadow else text


def drive(robot):
    if (folder := rows / f'r{robot}').exists():
        return
    shutil.rmtree(part := rows / f'r{robot}.part', ignore_errors=True)
    part.mkdir()
    (part / 'task.yaml').write_text(task_of(robot))
    options = ['--errors', '0.03'] * (robot % 3 == 2) + ['--wear', '0.2'] * (robot % 7 == 5)
    run(build / 'tests/robot/forereach_drives', part / 'task.yaml', '--seeds', str(drives), '--first-seed', str(1 + robot * drives),
        '--log', part / 'log', *options, codes=(0, 1))
    for log in part.glob('log/*.lcmlog'):
        log.unlink()
    part.rename(folder)


def rows_of(robot):
    with sqlite3.connect(f'file:{rows}/r{robot}/log/decisions.sqlite?mode=ro', uri=True) as database:
        return [database.execute(f'SELECT count(*) FROM {table}').fetchone()[0] for table in tables]


def timed(what, work):
    begin, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    result, after = work(), resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f'{what}: {time.monotonic() - begin:.1f} s, {cpu:.1f} s of processor', flush=True)
    return result


directory = pathlib.Path(sys.argv[4] if len(sys.argv) > 4 else tempfile.mkdtemp())
rows, server_of = directory / 'robots', directory / 'server'
rows.mkdir(parents=True, exist_ok=True)
directory.chmod(0o755)
shutil.rmtree(server_of, ignore_errors=True)
server_of.mkdir()
if as_nobody:
    shutil.chown(server_of, 'nobody')
server = None
try:
    each = ThreadPool(os.cpu_count())
    timed(f'{robots} robots, {drives} drives each', lambda: each.map(drive, range(robots), 1))
    wanted = [sum(counts) for counts in zip(*each.map(rows_of, range(robots)))]

    run(*as_nobody, programs[-1] / 'initdb', '-D', server_of / 'data', '-U', 'owner', '-A', 'trust', '-N')
    server = start(*as_nobody, programs[-1] / 'postgres', '-D', server_of / 'data', '-k', server_of, '-c', 'listen_addresses=', out=open(directory / 'server.log', 'w'))
    store = f'postgresql:///postgres?host={server_of}&user=owner'
    ask = lambda query: run(programs[-1] / 'psql', '-X', '-q', '-At', '-v', 'ON_ERROR_STOP=1', store, '-c', query)[0].strip()
    for _ in range(300):
        if subprocess.run([programs[-1] / 'pg_isready', '-q', '-h', server_of]).returncode == 0:
            break
        time.sleep(0.1)

    def ingest(robot):
        return run(build / 'cli/forereach', 'ingest', rows / f'r{robot}/log', '--robot', f'r{robot}', '--database', store)[1]

    largest = max(timed('ingest', lambda: [ingest(0), *each.map(ingest, range(1, robots), 1)]))  # the first makes the tables
    print(f'  {largest:.0f} MiB')
    got = [int(ask(f'SELECT count(*) FROM {table}')) for table in tables]
    print('\n'.join(f'  {count} {table}' for count, table in zip(got, tables)), f'\n  {sum(got)} rows')
    assert got == wanted, (got, wanted)
    assert ask('SELECT count(*) = count(DISTINCT event_digest) FROM decisions') == 't', 'decisions of one drive are there twice'
    for what in ['robot', 'log_file', 'model_digest', 'declaration_digest', 'outcome']:
        print(f'  {ask(f"SELECT count(DISTINCT {what}) FROM decisions")} {what}s')
    print('  on disk', ask('SELECT pg_size_pretty(pg_database_size(current_database()))'), flush=True)

    report = build / 'cli/forereach', 'report', '--database', store
    out, memory = timed('report', lambda: run(*report))
    print(f'  {memory:.0f} MiB\n{out[out.index("Causes"):out.index("Contradictions")]}')
    timed('report --out', lambda: run(*report, '--out', directory / 'fleet.html'))
finally:
    if server:
        server.send_signal(2)
        print(f'largest process of the server: {end(server)[1]:.0f} MiB')
    shutil.rmtree(server_of if len(sys.argv) > 4 else directory)
