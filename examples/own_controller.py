#!/usr/bin/env python3
"""A controller of one's own for `sparflow benchmark --process mine="python3 own_controller.py"` (docs/benchmark.md).

Every rod follows a straight line from where it is to where it shall be, with speed ahead and a proportional correction."""
import json
import sys

GAIN = 2.0  # [1/s]


def lever(valve, speed):
    way = "extend" if speed > 0 else "retract"
    share = abs(speed) / valve[way + "_m_s"]
    dead = valve["dead_" + way] * min(1.0, share / 0.01)
    return (1 if speed > 0 else -1) * min(1.0, dead + (1.0 - dead) * share)


task, begin = None, None
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "task":
        task, begin = message, None
        answer = {"type": "ready"}
    else:
        begin = begin or message
        phase = min(1.0, (message["t_s"] - begin["t_s"]) / (0.9 * task["duration_s"]))
        answer = {"u": {}}
        for rod, goal in task["goal"]["length_m"].items():
            way = goal - begin["length_m"][rod]
            error = begin["length_m"][rod] + phase * way - message["length_m"][rod]
            speed = (way / (0.9 * task["duration_s"]) if phase < 1.0 else 0.0) + GAIN * error
            answer["u"][rod] = lever(task["valves"][rod], speed) if abs(speed) > 0.002 else 0.0
    print(json.dumps(answer), flush=True)
