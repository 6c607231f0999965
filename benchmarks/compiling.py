"""Where the seconds of compiling go: of the processor, by stage and by function, in a process that compiles anew.

`SPENT` is put before the code of such a process and `LISTED` behind it; `listed` prints what it found.
"""

import json

LARGEST = 10
"""Functions that are printed."""
SPENT = """
import json, time
from collections import defaultdict
from numba.core import event
from llvmlite.binding import ffi

class Spent(event.Listener):
    def __init__(self):
        self.open, self.function, self.stage, self.times = [], defaultdict(float), defaultdict(float), defaultdict(int)

    def on_start(self, what):
        named = what.data["name"].split(" [")[0] if what.kind == "numba:run_pass" else what.data["dispatcher"].py_func
        self.open.append([named, time.process_time(), 0.0])

    def on_end(self, what):
        named, begun, below = self.open.pop()
        took = time.process_time() - begun
        if self.open:
            self.open[-1][2] += took
        if isinstance(named, str):
            self.stage[named] += took - below
        else:
            self.times[of(named)] += 1
        owners = (one for one, *_ in [*self.open[::-1], [named]] if not isinstance(one, str))
        owner = next(owners) if isinstance(named, str) else named
        self.function[of(owner)] += took - below

def of(function):
    return f"{function.__module__ or 'generated'}.{function.__qualname__}".removeprefix("palpate.")

spent = Spent()
for kind in ("numba:compile", "numba:run_pass"):
    event.register(kind, spent)
inside, deep, call = defaultdict(float), [0], ffi._lib_fn_wrapper.__call__
def timed(function, *arguments):
    begin = time.process_time()
    deep[0] += 1
    try:
        return call(function, *arguments)
    finally:
        deep[0] -= 1
        if not deep[0]:
            inside["LLVM"] += time.process_time() - begin
ffi._lib_fn_wrapper.__call__ = timed
begin = time.process_time()
"""
LISTED = """
print(json.dumps({
    "whole": time.process_time() - begin, "llvm": inside["LLVM"],
    "stage": spent.stage, "function": spent.function, "times": spent.times,
}))
"""
STAGES = {
    "reading bytecode, rewriting": (
        "translate_bytecode",
        "rewrite",
        "ssa",
        "ir_processing",
        "strip_phis",
        "legal",
        "prune",
    ),
    "types": ("type_inference",),
    "intermediate code and LLVM": ("lowering",),
}


def listed(printed: str, what: str) -> str:
    """The stages, and the functions that took most, in lines.

    Args:
        printed: by the process, its other lines too.
        what: was compiled.
    """
    found = json.loads(next(line for line in printed.splitlines() if line.startswith('{"whole"')))
    stages = {
        name: sum(took for key, took in found["stage"].items() if any(word in key for word in words))
        for name, words in STAGES.items()
    }
    stages["everything else: imports, look-ups between them"] = found["whole"] - sum(stages.values())
    count, times = len(found["times"]), sum(found["times"].values())
    lines = [
        f"{what}: {found['whole']:.2f} s of the processor, {count} functions compiled {times} times; of these seconds",
        *(f"  {took:6.2f}  {name}" for name, took in stages.items()),
        f"  {found['llvm']:6.2f}  in LLVM, whatever the stage: parsing, optimising, machine code",
        f"the {LARGEST} functions that took most, without those that they call:",
    ]
    largest = sorted(found["function"].items(), key=lambda item: -item[1])[:LARGEST]
    lines += [f"  {took:6.2f}  {name}" for name, took in largest]
    rest = sum(found["function"].values()) - sum(took for _, took in largest)
    return "\n".join([*lines, f"  {rest:6.2f}  the other {count - len(largest)}"])
