"""memory.py FOREREACH LONG_COURSE [ROUNDS]: commands over logs of any length take no more memory for a longer one.

Compares the largest memory of each with 10 and with 40 rounds of the recorded course; with ROUNDS, a round being 97
decisions, that of a log of so many with 256 MiB."""
import os
import shutil
import sys
import tempfile

forereach, long_course = sys.argv[1:3]
rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 0
scratch = tempfile.mkdtemp(dir='.' if rounds else None)
task = ['--config', 'tests/data/course.yaml']
commands = [['report'], ['replay'], ['replay', '--compare'], ['check-log'],
            *(['export', '--format', name, '-o', f'{scratch}/out'] for name in ['csv', 'jsonl', 'npz', 'mcap'])]
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


def peaks(count):
    directory = f'{scratch}/{count}'
    os.mkdir(directory)
    peak([long_course, directory, str(count)])
    log = [f'{directory}/{name}' for name in os.listdir(directory) if name.endswith('.lcmlog')]
    sizes = []
    for command in commands:
        sizes.append(peak([forereach, command[0], *([directory] if command[0] == 'check-log' else log), *task, *command[1:]]))
        for name in os.listdir(scratch):
            if name.startswith('out'):
                path = f'{scratch}/{name}'
                shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)
    return sizes


try:
    few, many = ([256] * len(commands), peaks(rounds)) if rounds else (peaks(10), peaks(40))
finally:
    shutil.rmtree(scratch)
for command, before, after in zip(commands, few, many):
    print(f'{" ".join(command[:3])}: {before:.0f} and {after:.0f} MiB')
    assert after <= before + (0 if rounds else 12), 'it grows with the log'
