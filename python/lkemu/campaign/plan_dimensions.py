"""Reads the dimensions and the exclusions of a plan."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Optional, Tuple, Union

from .plan import NO_FAULT, Dimension, Exclusion, Plan, whole_or_not
from .plan_text import PlanText, did_you_mean, flat, is_number
from .program import Program
from .values import Listed, Ranged, Value, Values, value_text

MAX_STEPS = 1e6
MAX_VALUE = 1e12


class DimensionReader:
    """Pre: faults, drives and scenario of the plan are set."""

    def __init__(self, text: PlanText, plan: Plan, program: Program) -> None:
        self.text, self.plan, self.program = text, plan, program

    def read_dimensions(self, table: Any) -> List[Dimension]:
        if not isinstance(table, dict) or not table:
            raise self.text.error("dimension", "missing, or empty")
        dimensions: List[Dimension] = []
        for name, node in sorted(flat(table), key=lambda one: self.text.lines.get("dimension." + one[0], 0)):
            if any(name == other.name for other in dimensions):
                raise self.text.error(f"dimension.{name}", "is defined twice")
            values = self.read_values(name, node)
            harmless = node.get("least", "from") if isinstance(node, dict) else "from"
            if harmless not in ("from", "to"):
                raise self.text.error(f"dimension.{name}", 'least must be "from" or "to"')
            dimensions.append(Dimension(name, values, harmless == "to"))
        return dimensions

    def words_of(self, name: str) -> Optional[List[str]]:
        """Returns the allowed words; None: numbers only; empty: numbers or any words. Raises PlanError if unknown."""
        numbers = {"fault.id", "fault.at_s", "fault.for_s", "fault.probability", "seed", "bitrate", "bus_load", "supply_V",
                   "ambient_C"}  # fmt: skip
        if name in numbers or name.startswith("load."):
            return None
        if name == "fault.kind":
            return [*self.plan.faults, NO_FAULT]
        if name == "generation":
            return self.program.generations()
        if name == "fault.bus":
            return sorted({str(drive["bus"]) for drive in self.plan.drives})
        if name.startswith("host.") and len(name) > len("host."):
            return []
        for kind, row in self.plan.faults.items():
            for parameter in row["parameters"]:
                if name == f"fault.{kind}.{parameter['name']}":
                    return parameter.get("choices")
        known = [*numbers, "fault.kind", "fault.bus", "generation"]
        known += [f"fault.{kind}.{one['name']}" for kind, row in self.plan.faults.items() for one in row["parameters"]]
        raise self.text.error(f"dimension.{name}", "unknown dimension" + did_you_mean(name, known))

    def rounding_of(self, name: str) -> str:
        if name in ("fault.at_s", "fault.for_s"):
            return "ms"
        if name in ("fault.id", "seed", "bitrate"):
            return "whole"
        parts = name.split(".")
        if parts[0] == "fault" and len(parts) == 3:
            parameter = next(one for one in self.plan.faults[parts[1]]["parameters"] if one["name"] == parts[2])
            return "whole" if parameter.get("whole") else "figures"
        return "figures"

    def read_values(self, name: str, node: Any) -> Values:
        words = self.words_of(name)
        key = f"dimension.{name}"
        if node == "all" and words:
            return Listed(self.possible_kinds() if name == "fault.kind" else words)
        if name == "fault.kind" and isinstance(node, list) and "all" in node:
            return Listed(self.read_list(key, [*(one for one in node if one != "all"), *self.possible_kinds()], words))
        if not isinstance(node, dict):
            return Listed(self.read_list(key, node, words))
        known = {"from", "to", "step", "log", "mean", "sd", "values", "weights", "least"}
        self.text.check_keys(node, known, key + ".")
        if "values" in node:
            return self.weighted(key, node, words)
        if words:
            raise self.text.error(key, "must be a word or a list of words")
        if "weights" in node:
            raise self.text.error(key, "weights need values")
        start, stop = (self.text.number(key, node.get(end), "a range needs from and to") for end in ("from", "to"))
        if not start < stop:
            raise self.text.error(key, "the range is empty: to must be above from")
        if "step" in node:
            return self.stepped(key, node, start, stop)
        log = bool(node.get("log", False))
        if log and start <= 0:
            raise self.text.error(key, "must be above 0 for log")
        if ("mean" in node) != ("sd" in node):
            raise self.text.error(key, "mean and sd must be given together")
        if "mean" in node and log:
            raise self.text.error(key, "log does not go together with mean")
        mean = self.text.number(key, node["mean"], "mean must be a number") if "mean" in node else None
        sd = self.text.number(key, node.get("sd", 1.0), "sd must be a number")
        if not 0 < sd <= MAX_VALUE:
            raise self.text.error(key, "sd must be above 0")
        return Ranged(start, stop, log, mean, sd, self.rounding_of(name))

    def read_list(self, key: str, node: Any, words: Optional[List[str]]) -> List[Value]:
        given = node if isinstance(node, list) else [node]
        if not given:
            raise self.text.error(key, "is empty")
        values: List[Value] = []
        for one in given:
            if isinstance(one, str) and words is not None:
                if words and one not in words:
                    raise self.text.error(key, f'"{one}" is unknown' + did_you_mean(one, words))
                values.append(one)
            elif words:
                raise self.text.error(key, "must be a word or a list of words")
            else:
                values.append(self.text.number(key, one, "must be a number"))
            if isinstance(values[-1], str) != isinstance(values[0], str):
                raise self.text.error(key, "mixes numbers and words")
            if values[-1] in values[:-1]:
                raise self.text.error(key, f"has {value_text(values[-1])} twice")
        return values

    def weighted(self, key: str, node: Mapping[str, Any], words: Optional[List[str]]) -> Listed:
        for other in node:
            if other not in ("values", "weights", "least"):
                raise self.text.error(key, f"{other} does not go together with values")
        values = self.read_list(key, node["values"], words)
        weights = node.get("weights")
        if not isinstance(weights, list):
            raise self.text.error(key, "values need weights; without weights, write a list: [ … ]")
        if not all(is_number(one) and 0 <= one <= MAX_VALUE for one in weights):
            raise self.text.error(key, "weights are 0 or more")
        if len(weights) != len(values):
            raise self.text.error(key, "needs as many weights as values")
        if not any(weights):
            raise self.text.error(key, "all weights are 0")
        return Listed(values, [float(one) for one in weights])

    def stepped(self, key: str, node: Mapping[str, Any], start: float, stop: float) -> Listed:
        for other in ("log", "mean", "sd"):
            if other in node:
                raise self.text.error(key, f"{other} does not go together with step")
        step = node["step"]
        if not is_number(step) or step <= 0 or (stop - start) / step > MAX_STEPS:
            raise self.text.error(key, "step must be above 0, and a millionth of the range or more")
        steps = math.floor((stop - start) / step + 1e-9)
        # Rounded to 1e-9, which removes rounding errors of the multiplication.
        return Listed([float(round((start + n * step) * 1e9)) / 1e9 for n in range(steps + 1)])

    def possible_kinds(self) -> List[str]:
        """Returns the kinds of fault that a drive of the first bus accepts."""
        bus = self.plan.drives[0]["bus"]
        ids = [drive["id"] for drive in self.plan.drives if drive["bus"] == bus]
        requests = []
        for kind, row in self.plan.faults.items():
            needed = [one for one in row["parameters"] if one["required"]]
            needed += row["parameters"][:1] if row["needs_one"] else []
            # Both ends of each range are tried, because a drive refuses, for example, its current ID.
            for end in ("min", "max"):
                parameters = {one["name"]: whole_or_not(one[end]) for one in needed}
                for drive in [None] if row["of_bus"] else ids:
                    event = {"at_s": 0, "bus": bus, "fault": {"kind": kind, **parameters}}
                    if drive is not None:
                        event["id"] = drive
                    requests.append({"case": list(self.plan.faults).index(kind), "scenario": self.plan.scenario, "fault": event})
        possible = {seen["case"] for seen in self.program.check(requests) if "error" not in seen}
        return [kind for n, kind in enumerate(self.plan.faults) if n in possible]

    def read_exclusion(self, table: Any) -> Exclusion:
        if not isinstance(table, dict) or not table:
            raise self.text.error("exclude", "is empty and would exclude every case")
        exclusion: Dict[int, Union[List[Value], Tuple[float, float]]] = {}
        names = [dimension.name for dimension in self.plan.dimensions]
        for name, node in flat(table):
            key = f"exclude.{name}"
            if name not in names:
                raise self.text.error(key, "is not a dimension of this plan")
            n = names.index(name)
            if not isinstance(node, dict):
                exclusion[n] = self.read_list(key, node, self.words_of(name))
                continue
            self.text.check_keys(node, {"from", "to"}, key + ".")
            if self.plan.dimensions[n].values.has_words:
                raise self.text.error(key, "has words, not numbers: give a word or a list of words")
            start = self.text.number(key, node.get("from", -MAX_VALUE), "from must be a number")
            stop = self.text.number(key, node.get("to", MAX_VALUE), "to must be a number")
            if start > stop:
                raise self.text.error(key, "the range is empty: to is below from")
            exclusion[n] = (start, stop)
        return exclusion
