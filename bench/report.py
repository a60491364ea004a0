#!/usr/bin/env python3
"""Writes the performance report: fills the @names@ of a template from the benchmarks' JSON.

  bench/report.py --results DIR --build DIR [--load L] [--command TEXT] TEMPLATE OUTPUT
"""
import argparse
import json
import math
import os
import re
import subprocess
from datetime import date
from pathlib import Path

SIZES = [25, 400, 10_000, 1_000_000, 10_000_000]
SCENARIOS = ["bicycle", "point_mass", "dense"]
TO_MICROSECONDS = {"ns": 1e-3, "us": 1, "ms": 1e3, "s": 1e6}


class Benchmark:
    """One repetition of a benchmark; times in microseconds."""

    def __init__(self, entry):
        scale = TO_MICROSECONDS[entry["time_unit"]]
        self.cpu, self.real = entry["cpu_time"] * scale, entry["real_time"] * scale
        self.rate, self.bytes = entry.get("items_per_second"), entry.get("bytes")
        self.widths = [entry.get("width_" + name) for name in ("x", "y", "theta")]

    # Others' work on the machine disturbs the fastest repetition least.
    def is_faster_than(self, other):
        return self.rate > other.rate if self.rate else self.cpu < other.cpu


def read_benchmarks(path):
    found = {}
    for entry in json.loads(path.read_text())["benchmarks"]:
        if entry.get("error_occurred") or entry["run_type"] != "iteration":
            continue
        name, repetition = entry["run_name"], Benchmark(entry)
        if name not in found or repetition.is_faster_than(found[name]):
            found[name] = repetition
    return found


def number(value, digits=3):
    """To so many significant digits, at least all those before the point; with thousands set apart."""
    if value is None:
        return "-"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0
    return f"{value:,.{decimals}f}"


def table(header, rows):
    lines = [header, ["---"] + ["---:"] * (len(header) - 1)] + rows
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def ratio(a, b):
    return a / b if a is not None and b is not None else None


class Report:
    def __init__(self, arguments):
        self.arguments = arguments
        results = Path(arguments.results)
        self.benchmarks = {}
        for name in ("certify_bench", "batches", "gate_bench", "comparison"):
            if name != "batches" or (results / "batches.json").exists():  # else they are among the first
                self.benchmarks |= read_benchmarks(results / f"{name}.json")
        self.tail_data = json.loads((results / "tail.json").read_text())
        self.bus_data = json.loads((results / "bus_round_trip.json").read_text())
        self.withdrawal_data = json.loads((results / "withdrawal.json").read_text())

    def cpu(self, name):
        return self.benchmarks[name].cpu if name in self.benchmarks else None

    # How much longer the calls of tasks take among a map's cells, the most first.
    def among_cells(self):
        names = [name.split("/", 1)[1].removesuffix("/none") for name in self.benchmarks if re.fullmatch("task/.*/none", name)]
        return sorted(((ratio(self.cpu(f"task/{name}/map_2000"), self.cpu(f"task/{name}/none")), name) for name in names), reverse=True)

    # What stands for each @name@ of the template.

    def command(self):
        return self.arguments.command

    def machine(self):
        lscpu = dict(line.split(":", 1) for line in output("lscpu").splitlines() if ":" in line)
        compiler, flags = compiled_with(Path(self.arguments.build))
        commit = output("git", "rev-parse", "--short", "HEAD")
        changed = " with changes" if output("git", "status", "--porcelain", "--untracked-files=no") else ""
        return table(["", ""], [
            ["processor", f"{lscpu.get('Model name', '?').strip()}, {os.cpu_count()} cores" + virtualised(lscpu)],
            ["system", f"{os_name()}, Linux {os.uname().release}"],
            ["compiler", compiler],
            ["flags", f"`{flags}`"],
            ["commit", commit + changed],
            ["date", date.today().isoformat()],
            ["load before", self.arguments.load],
        ]).replace("---:", "---")

    def done(self):
        certify = {n: self.cpu(f"certify/bicycle/{n}") for n in SIZES}
        growth = None
        if certify[400] and certify[1_000_000]:
            growth = math.log(certify[1_000_000] / certify[400]) / math.log(1_000_000 / 400)
        rigour = ratio(certify[400], self.cpu("certify_unrounded/bicycle/400"))
        threads, scaling = self.scaling()
        tasks = self.among_cells()
        extension = self.benchmarks.get("stage/extension/bicycle/400")
        rows = [
            at_least(f"ratio to the straightforward version{spelling}, {scenario.replace('_', ' ')}",
                     ratio(self.cpu(f"{plain}/{scenario}/400"), self.cpu(f"certify/{scenario}/400")), least,
                     "as above" if spelling else then)
            for scenario, matrices, loops, then in (
                ("bicycle", 85, 52, "safety and expansion, each 17 % of the instructions"),
                ("point_mass", 150, 80, "two rows at once"))
            for plain, spelling, least in (("straightforward", "", matrices),
                                           ("straightforward_loops", " by loops", loops))
        ] + [
            at_least("AVX2 over AVX-512, the least of the tasks",
                     min(wider) if (wider := [ratio(avx2, self.cpu(f"certify/{scenario}/400")) for scenario in SCENARIOS
                                              if (avx2 := self.cpu(f"certify_avx2/{scenario}/400"))]) else None,
                     1.2, "shorter chains of operations"),
            at_most("growth from N = 400 to 10^6, power of N", growth, 0.05,
                    "both sides in one descent"),
            at_most("method centred over paper, bicycle",
                    ratio(self.cpu("certify_centred/bicycle/400"), certify[400]), 1.1, "its second derivatives in lanes"),
            at_most("with rounding bounds over without", rigour, 1.05, "instructions of both, by stage"),
            at_most("p99 of the bus with the certifier over a bare echo, certificates",
                    self.bus_data["certified"]["ratio_p99"], 1.2, "an idle machine"),
            at_most("the same, abstentions", self.bus_data["abstained"]["ratio_p99"], 1.2, "an idle machine"),
            at_most("decision after a pause, kept warm, over one in a loop", ratio(*self.pauses("kept_warm")), 2,
                    "ticks of 1 ms: in 1 ms 4 us are lost"),
            at_most("dense declaration, microseconds", self.cpu("certify/dense/400"), 100, "larger leaves"),
            at_least(f"batch on {threads} cores over one core", scaling, 0.9 * threads,
                     "an idle machine"),
            at_most(f"1,000 chunks of 20 steps, {threads} cores, milliseconds", self.chunk_ms(threads), 10, "an idle machine"),
            at_most("`Extend`, microseconds a step", extension and extension.cpu, 0.3,
                    "what the test of one slice sets up"),
            at_most("its node, bytes", extension and extension.bytes, 2048, "a lower order"),
        ] + [
            at_most(f"2,000 cells {place}",
                    [ratio(self.cpu(f"map/{body}/{cells}_2000"), self.cpu(f"map/{body}/none"))
                     for body in ("point", "rectangle", "rectangle_swept")], 1.5,
                    "fewer pairs refined" if cells == "street" else "as above")
            for place, cells in (("along a street, over none: point, rectangle, rectangle at all times", "street"),
                                 ("anywhere, the same", "map"))
        ] + [
            at_least(f"so many of {len(tasks)} tasks of `config/` at most 1.5 times (most: {', '.join(f'{name} {number(most)}' for most, name in tasks[:3])})",
                     sum(each <= 1.5 for each, _ in tasks) if tasks else None, len(tasks), "units that overlap")
        ] + [
            at_most(label, self.beside_compiled(name), bound,
                    "fewer terms in the chain rule of its stages")
            for label, name, bound in (
                ("bicycle by Runge-Kutta as text over the compiled Euler step", "bicycle_rk4", 6.8),
                ("quadrotor by Runge-Kutta as text, 20 steps, over 12 of the compiled bicycle", "quadrotor_rk4_20_steps", 110))
        ] + OF_RESEARCH
        return table(["", "asked", "measured", ""], rows)

    def certify(self):
        rows = []
        for scenario in SCENARIOS:
            for size in SIZES:
                ours, plain, loops = (self.cpu(f"{kind}/{scenario}/{size}")
                                      for kind in ("certify", "straightforward", "straightforward_loops"))
                if ours or plain:
                    rows.append([f"{scenario}, N = {size:,}", number(ours), number(plain),
                                 number(ratio(plain, ours)), number(loops), number(ratio(loops, ours))])
        return table(["", "ForeReach", "straightforward", "ratio", "by loops", "ratio"], rows)

    def stages(self):
        by_stage = {}
        for name in self.benchmarks:
            if match := re.fullmatch(r"stage/(\w+)/(\w+)/(\d+)", name):
                by_stage.setdefault(match[1], {}).setdefault(match[2], {})[int(match[3])] = self.cpu(name)
        rows = []
        sizes = [n for n in SIZES if any(n in times for scenarios in by_stage.values() for times in scenarios.values())]
        for stage, scenarios in by_stage.items():
            for scenario, times in scenarios.items():
                if list(times) == [400]:  # does not depend on N: goes last
                    cells = [stage.replace("_", ", "), number(times[400])] + [""] * (len(sizes) - 1)
                    rows.append((1, cells))
                else:
                    cells = [f"{stage.replace('_', ', ')}, {scenario}"] + [number(times.get(n)) for n in sizes]
                    rows.append((0, cells))
        return table(["", *(f"N = {n:,}" for n in sizes)], [cells for _, cells in sorted(rows)])

    def plain_pairwise(self):
        times = [f"{number(time)} at N = {n:,}" for n in SIZES
                 if (time := self.cpu(f"straightforward_pairwise/bicycle/{n}"))]
        return ", ".join(times) or "not measured"

    def insertion(self):
        times = {}
        for name in self.benchmarks:
            if match := re.fullmatch(r"stage/insertion/bicycle/(\d+)/iterations:\d+", name):
                times[int(match[1])] = self.cpu(name)
        return ", ".join(f"{number(time)} at N = {n:,}" for n, time in sorted(times.items())) or "not measured"

    def batch_rates(self):
        rates = {}
        for name, benchmark in self.benchmarks.items():
            if match := re.fullmatch(r"batch/.*/(\d+)/real_time", name):
                rates[int(match[1])] = benchmark.rate
        return rates

    def scaling(self):
        rates = self.batch_rates()
        most = max(rates, default=1)
        return most, ratio(rates.get(most), rates.get(1))

    def batch(self):
        rates = self.batch_rates()
        rows = [[str(threads), number(rate, 4), number(ratio(rate, rates[1]))] for threads, rate in sorted(rates.items())]
        return ("Bicycle: `CertifyAll`, threads share one certifier.\n\n"
                + table(["threads", "plans a second", "over one thread"], rows) + "\n\n" + self.chunks())

    def chunk_ms(self, threads):
        benchmark = self.benchmarks.get(f"chunks/apart/{threads}/real_time")
        return benchmark and benchmark.real / 1e3

    def chunks(self):
        rows = []
        for kind, text in [("apart", "share nothing"), ("kin", "share 15 steps by fives")]:
            took = {by: self.benchmarks.get(f"chunks/{kind}/{by}/real_time") for by in ["loop", *sorted(self.batch_rates())]
                    if kind == "kin" or by != 1}
            real = {by: benchmark and benchmark.real for by, benchmark in took.items()}
            rows += [[f"{text}, " + ("loop" if by == "loop" else f"threads: {by}"), number(us, 4), number(ratio(real["loop"], us))]
                     for by, us in real.items()]
        return ("1,000 chunks of 20 steps from one X0 among 11 circles: a loop of `Certify`, and `CertifyAll`, by the "
                "clock.\n\n" + table(["chunks", "us", "over the loop"], rows))

    def tail(self):
        keys = ["p50", "p99", "p99.9", "p99.99", "max"]
        rows = [[label] + [number(self.tail_data[name][key]) for key in keys]
                for name, label in (("bicycle", "certify"), ("clock", "reading the clock alone"))]
        return (f"{self.tail_data['bicycle']['count']:,} calls of the bicycle, each by itself, with plans that vary by 5 %.\n\n"
                + table(["", *keys], rows))

    def gate(self):
        labels = {
            "gate/certified/manual_time": "the whole gate, certificate",
            "gate/abstained/manual_time": "the whole gate, abstention S",
            "gate/certify_alone": "certify call within it",
            "gate/decode_candidate": "decode the candidate",
            "gate/digest_candidate": "digest of the candidate",
            "gate/certificate_digest": "digest of the certificate",
            "gate/encode_certified": "encode the certified plan",
            "gate/encode_decision": "encode the decision",
        }
        rows = []
        for name, label in labels.items():
            benchmark = self.benchmarks.get(name)
            rows.append([label, number(benchmark and (benchmark.real if "manual" in name else benchmark.cpu))])
        return table(["", "us"], rows)

    def bus(self):
        rows = []
        for name, label in (("certified", "certificate"), ("abstained", "abstention")):
            data = self.bus_data[name]
            of_both = {what: {p: data[f"{what}_{p}"] for p in ("p50", "p99")} for what in ("added", "ratio")}
            for what, times in {"echo": data["echo"], "certifier": data["certifier"],
                                "the gate's work, as the decisions say": data["gate"], **of_both}.items():
                rows.append([f"{label}: {what}", number(times["p50"]), number(times["p99"])])
        counts = [self.bus_data[name]["certifier"]["count"] for name in ("certified", "abstained")]
        lost = sum(self.bus_data[name]["lost"] for name in ("certified", "abstained"))
        return table(["", "p50", "p99"], rows) + f"\n\n{sum(counts):,} round trips each, {lost} lost."

    def beside(self, group, header, labels):
        """Those of a group that there are, beside the first."""
        found = {label: self.benchmarks[f"{group}/{name}"] for name, label in labels.items() if f"{group}/{name}" in self.benchmarks}
        first = self.benchmarks.get(f"{group}/{next(iter(labels))}")
        return table(["", "us", header], [[label, number(each.cpu), f"{each.cpu / first.cpu:.2f}"] for label, each in found.items()])

    # The gate's work after pauses and in a loop.
    def pauses(self, kind):
        return self.bus_data["after_pauses"][kind]["p50"], self.bus_data["certified"]["gate"]["p50"]

    def cold(self):
        (cold, loop), (warm, _) = self.pauses("cold"), self.pauses("kept_warm")
        return (f"After 10 ms in which another program has used the caches, a decision takes {number(cold)} us at the median, with "
                f"`realtime.keep_warm` {number(warm)}, and in a loop {number(loop)}.")

    def worlds(self):
        return self.beside("world", "beside the point", {
            "point": "point, at the samples",
            "disc_at_frame": "disc around the point, at the samples",
            "disc": "disc ahead of the point, at the samples",
            "rectangle": "rectangle, at the samples",
            "point_swept": "point, at all times",
            "disc_swept": "disc, at all times",
            "rectangle_swept": "rectangle, at all times",
            "disc_moving": "disc, at all times, the circle moves"})

    def beside_compiled(self, name):
        return ratio(self.cpu("model/" + name), self.cpu("model/bicycle_compiled"))

    def models(self):
        return self.beside("model", "beside the compiled bicycle", {
            "bicycle_compiled": "bicycle, compiled",
            "bicycle_text": "bicycle, text",
            "bicycle_midpoint": "bicycle, text, midpoint",
            "bicycle_midpoint_next": "bicycle, text, midpoint written out in `next`",
            "bicycle_rk4": "bicycle, text, Runge-Kutta",
            "quadrotor_rk4_20_steps": "quadrotor, text, Runge-Kutta, 20 steps"})

    def withdrawals(self):
        rows = []
        for name, label in (("withdrawn", "withdrawal"), ("answered", "the robot's answer")):
            data = self.withdrawal_data[name]
            rows.append([label, number(data["count"], 1), *(number(data[p]) for p in ("p50", "p99", "max"))])
        return table(["", "count", "p50", "p99", "max"], rows) + f"\n\n{self.withdrawal_data['lost']} were lost."

    def nominal(self):
        rows = []
        for name, label, rigorous in (
            ("sampled_inner_hull/iterations:1", "sampled inner hull", ""),
            ("forereach", "**ForeReach**", "yes"),
            ("forereach_paper", "**ForeReach**, method: paper", "yes"),
            ("straightforward", "straightforward, Eigen", "no"),
            ("boost_natural", "Boost.Interval, natural", "up to the C library's sin, cos, tan"),
            ("boost_mean_value", "Boost.Interval, mean value", "up to the C library's sin, cos, tan"),
        ):
            if benchmark := self.benchmarks.get("nominal_tube/" + name):
                time = "-" if "sampled" in name else number(benchmark.cpu)
                rows.append([label, time, *(f"{width:.5f}" for width in benchmark.widths), rigorous])
        return table(["tool", "us", "x", "y", "theta", "rigorous"], rows)


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def virtualised(lscpu):
    hypervisor = lscpu.get("Hypervisor vendor")
    return f", virtual ({hypervisor.strip()})" if hypervisor else ""


def os_name():
    fields = dict(line.split("=", 1) for line in Path("/etc/os-release").read_text().splitlines() if "=" in line)
    return fields.get("PRETTY_NAME", "?").strip('"')


def compiled_with(build):
    """Compiler and flags of the certifier library, as the build has them."""
    for entry in json.loads((build / "compile_commands.json").read_text()):
        if entry["file"].endswith("forereach/certify/certifier.cpp"):
            words = entry["command"].split()
            compiler = next(word for word in words if word.endswith(("++", "g++-12", "clang++")))
            flags = [word for word in words if re.match(r"-(O|f|m|std|DNDEBUG)", word)]
            return output(compiler, "--version").splitlines()[0], " ".join(flags)
    return "?", "?"


def at_most(label, value, bound, then=""):
    return criterion(label, value, bound, "at most", lambda each: each <= bound, then)


def at_least(label, value, bound, then=""):
    return criterion(label, value, bound, "at least", lambda each: each >= bound, then)


# value: one, or several that have to be met together. then: what the next step would be
def criterion(label, value, bound, relation, met, then=""):
    values = value if isinstance(value, list) else [value]
    verdict = ("not measured" if None in values else "met" if all(map(met, values))
               else "**not met**" + (f"; next: {then}" if then else ""))
    return [label, f"{relation} {bound:g}", ", ".join(map(number, values)), verdict]


# By hand: what these print. They need the build of research/, which takes longer than all that is measured here.
OF_RESEARCH = [
    at_least("regions: recall of group C, N = 25 (`research/run regional`)", 1.0, 0.99),
    at_most("half-width over the inner bound, X_0 in 64 parts, N = 25, 50, 100 (`research/run tightness`)", [1.076, 1.058, 1.050], 1.08),
    at_least("recall in pieces of X_0, N = 25", 0.612, 0.63, "slopes of rows with a plain L"),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", required=True)
    parser.add_argument("--build", required=True)
    parser.add_argument("--load", default="?")
    parser.add_argument("--command", default="scripts/bench")
    parser.add_argument("template")
    parser.add_argument("output")
    arguments = parser.parse_args()
    report = Report(arguments)
    sizes = {name: f"{size:,}" for name, size in report.bus_data.items() if name.endswith("_bytes")}
    text = re.sub(r"@(\w+)@", lambda match: sizes.get(match[1]) or getattr(report, match[1])(), Path(arguments.template).read_text())
    Path(arguments.output).write_text(text)


if __name__ == "__main__":
    main()
