"""Times of two programs, compared in turns (A B B A) on one machine, and verdicts that own up to noise.

A machine drifts by tens of percent within minutes, so only ratios of neighbouring runs count: every round runs old,
new, new, old and gives two pairs, in each of which every frame's step has a ratio. The figure is the median of all ratios;
its interval comes from drawing whole pairs anew (frames of a pair share the drift, so they are not drawn)."""
import csv
import random
import statistics

LIMIT = 1.03         # ratio new/old; a step beyond it is slower (ours: what a change that only moves code may cost)
SMALL_SHARE = 0.01   # steps below this share of the frame's time are shown, not judged
SMALL_SECONDS = 5e-5 # likewise below this (ours: what starting a thread or a clock's tick may cost)
DRAWS, CONFIDENCE = 1000, 0.95
NOT_JUDGED = {"waiting", "rest"}  # kinds of steps: for the writers; what no step names


def steps_of(timings, kinds):
    """{step: {frame: seconds}} of a timings.csv, without first frames and what runs beside rendering. Steps before
    the first frame are frame 0 of "start: STEP"; `rendering` sums a frame's steps. `kinds`: {step: kind}, as
    `catoptric list steps --json` names them."""
    found = {}
    with open(timings, newline="") as file:
        for row in csv.DictReader(file):
            frame = int(row["frame"])
            if row["clock"] == "overlapped" or (frame and row["first"] == "1") or kinds.get(row["step"]) in NOT_JUDGED:
                continue
            for step in ([row["step"], "rendering"] if frame else ["start: " + row["step"]]):
                frames = found.setdefault(step, {})
                frames[frame] = frames.get(frame, 0.0) + float(row["seconds"])
    return found


def pair_ratios(old, new):
    """{step: [new/old of every frame that both have]} of two runs' steps."""
    return {step: [new[step][n] / s for n, s in frames.items() if s > 0 and n in new[step]]
            for step, frames in old.items() if step in new}


def interval(pairs, seed=1):
    """(median, low, high) of ratios; `pairs` is a list of lists, one for each pair of runs."""
    pairs = [p for p in pairs if p]
    middle = statistics.median(r for p in pairs for r in p)
    draw = random.Random(seed)
    drawn = sorted(statistics.median(r for p in draw.choices(pairs, k=len(pairs)) for r in p) for _ in range(DRAWS))
    edge = int(DRAWS * (1 - CONFIDENCE) / 2)
    return middle, drawn[edge], drawn[-1 - edge]


def verdict(low, high, limit=LIMIT):
    return "holds" if high <= limit else "fails" if low > limit else "undecided"


class Pairs:
    """The pairs of runs of one method of one config."""

    def __init__(self):
        self.ratios = {}   # step: one list of ratios per pair
        self.seconds = {}  # step: of the old program

    def add(self, old, new):
        for step, ratios in pair_ratios(old, new).items():
            self.ratios.setdefault(step, []).append(ratios)
        for step, frames in old.items():
            self.seconds.setdefault(step, []).extend(frames.values())

    def rows(self):
        """(step, old ms, ratio, low, high, verdict) of every step; small ones have the verdict `small`."""
        whole = {True: sum(statistics.median(s) for n, s in self.seconds.items() if n.startswith("start: ")),
                 False: statistics.median(self.seconds.get("rendering", [0.0]))}
        for step, pairs in self.ratios.items():
            if not any(pairs):
                continue
            seconds = statistics.median(self.seconds[step])
            figures = interval(pairs)
            small = seconds < max(SMALL_SECONDS, SMALL_SHARE * whole[step.startswith("start: ")])
            yield (step, seconds * 1e3, *figures, "small" if small else verdict(*figures[1:]))
