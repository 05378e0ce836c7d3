"""The methods of a program and what its registry says that tests must know of them: tests of every method take them
from here, so that a new method needs no line in a test."""

import json
import subprocess


class Methods:
    def __init__(self, program):
        done = subprocess.run([program, "list", "methods", "counters", "--json"], check=True, capture_output=True)
        listed = json.loads(done.stdout)
        # An alias is a method with a setting of its own
        self.entries = [{**m, "name": name} for m in listed["methods"] for name in [m["name"], *m["aliases"]]]
        self.names = [m["name"] for m in self.entries]
        # The list has all counters; those of the program itself are no method's
        own = {c["name"] for m in self.entries for c in m["counters"]}
        self.common = [c for c in listed["counters"] if c["name"] not in own]

    def configured(self, refracting=False):
        """For "methods" of a run config: every method with the options for small frames."""
        return [{"method": m["name"], **m["tests"]["small"], **(m["tests"]["refracting"] if refracting else {})}
                for m in self.entries]

    def refracting(self):
        """Those with options for bodies that refract."""
        return [config for config, m in zip(self.configured(True), self.entries) if m["tests"]["refracting"]]

    def variants(self):
        """Methods with settings by which they make frames in another way, under names of their own."""
        return [{"method": m["name"], "name": f"{m['name']}_{i}", **m["tests"]["small"], **variant}
                for m in self.entries for i, variant in enumerate(m["tests"]["variants"], 1)]

    def counters(self, name):
        """Of a method and of the program."""
        return next(m["counters"] for m in self.entries if m["name"] == name) + self.common
