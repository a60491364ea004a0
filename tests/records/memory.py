"""memory.py FOREREACH LONG_COURSE [ROUNDS]: commands over logs of any length take no more memory for a longer one.

Compares the largest memory of each with 10 and with 40 rounds of the recorded course, and with 10 and 400 rounds in which
the certifier goes on learning: 74 transitions each, which what only reads them keeps, and replay as a gate does. With ROUNDS, a round
being 97 decisions, and 13 times as many that learn, each has 256 MiB."""
import os
import shutil
import sys
import tempfile

forereach, long_course = sys.argv[1:3]
rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 0
scratch = tempfile.mkdtemp(dir='.' if rounds else None)
task = ['--config', 'tests/data/course.yaml']
exports = [['export', '--format', name, '-o', f'{scratch}/out'] for name in ['csv', 'jsonl', 'npz', 'mcap']]
# It reads everything, verifies some, and keeps the last 4096 plans of 8.5 kB.
verify, plans = ['verify', '--shard', '1/1000', '--out', f'{scratch}/out'], 34
commands = [['report'], ['replay'], ['replay', '--compare'], ['check-log'], verify, *exports]
learning = [['report'], ['check-log'], exports[0]]
if rounds:  # these hold the last tubes that they draw, and the last abstentions
    commands += [['report', '--picture', f'{scratch}/out.png'], ['report', '--advice-seconds', '0', '--out', f'{scratch}/out.html'],
                 ['advise', '--advice-seconds', '0']]


def peak(arguments):
    """MiB."""
    process = os.posix_spawn(arguments[0], arguments, os.environ,
                             file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])
    _, status, usage = os.wait4(process, 0)
    assert os.waitstatus_to_exitcode(status) in ([0, 1] if arguments[1] == 'advise' else [0]), arguments
    return usage.ru_maxrss / 1024


def peaks(some, count, kind):
    directory = f'{scratch}/{kind}{count}'
    os.mkdir(directory)
    peak([long_course, directory, str(count), kind])
    log = [f'{directory}/{name}' for name in os.listdir(directory) if name.endswith('.lcmlog')]
    sizes = []
    for command in some:
        sizes.append(peak([forereach, command[0], *([directory] if command[0] == 'check-log' else log), *task, *command[1:]]))
        for name in os.listdir(scratch):
            if name.startswith('out'):
                path = f'{scratch}/{name}'
                shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)
    shutil.rmtree(directory)
    return sizes


def compare(some, kind, few, many, more):
    """@param more: how many MiB of another command than verify may be more."""
    before = [256] * len(some) if rounds else peaks(some, few, kind)
    for command, size, larger in zip(some, before, peaks(some, many, kind)):
        print(f'{kind} {" ".join(command[:3])}: {size:.0f} and {larger:.0f} MiB', flush=True)
        assert larger <= size + (0 if rounds else more + plans * (command is verify)), 'it grows with the log'


try:
    compare(commands, 'reload', 10, rounds or 40, 12)
    compare(learning, 'learn', 10, 13 * rounds or 400, 6 + 390 * 74 * 150 / 2**20)
    if not rounds:  # a gate that learns needs what it needs on the robot
        compare([['replay']], 'learn', 10, 1000, 6 + 990 * 74 * 700 / 2**20)
finally:
    shutil.rmtree(scratch)
