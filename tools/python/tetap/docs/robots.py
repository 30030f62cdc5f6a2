# SPDX-License-Identifier: Apache-2.0
"""The page of the shipped robots: what each is, its sensors and when to copy it from docs/reference/robots.tsv, its estimators from its header in config/."""
import os
import re

from tetap.docs.words import HEAD, WordError, read

LIST = "docs/reference/robots.tsv"


def estimators(text, path):
    """Names of the estimators of a robot's file, in the order of their outputs. A robot with a map among its data is a struct that derives from its list."""
    found = re.search(r"^(?:using Estimators =|struct Estimators :)\s*((?:node::With\w+<\s*)*)node::Estimators(?:WithPlaces<\d+,\s*|<)(.*?)>(?:;| \{)$", text, re.S | re.M)
    if found is None:
        raise WordError(f"{path}: no `using Estimators = node::Estimators<...>;`")
    aliases = dict(re.findall(r"^using (\w+) = estimators::WithSensors<\s*estimators::(\w+),", text, re.M))
    names = [re.sub(r"\b(?:estimators|FusionRule)::k?", "", " ".join(one.split())) for one in re.split(r",\s*(?![^<]*>)", found[2][:len(found[2]) - found[1].count("<")])]
    return [aliases.get(name, name) for name in names]


def robots(root):
    """The page; a robot of config/ without a line is the reader's own and not in it."""
    parts = [HEAD.format(f"{LIST} and config/*.hpp") + "# Robots\n\nEvery file of `config/` is a robot. Copy the one whose sensors are yours ([your robot](../tutorial/your_robot.md)). "
             "The estimators are in the order of their outputs, `Est0` first ([which estimator](../explanation/which_estimator.md)). The last one is the estimate that "
             "`Est_Status` describes.\n\n| robot | what it is | sensors | estimators | copy it for |\n|---|---|---|---|---|"]
    seen = set()
    for number, line in enumerate(read(root, LIST).splitlines(), 1):
        if not line or line.startswith("#"):
            continue
        cells = line.split("\t")
        if len(cells) != 4 or not all(cell.strip() for cell in cells):
            raise WordError(f"{LIST}:{number}: expected robot, what it is, sensors and when to copy it, with tabs between")
        robot, what, sensors, purpose = cells
        path = f"config/{robot}.hpp"
        if robot in seen or not os.path.exists(os.path.join(root, path)):
            raise WordError(f"{LIST}:{number}: {robot} " + ("stands twice" if robot in seen else f"is no robot: there is no {path}"))
        seen.add(robot)
        parts.append(f"| `{robot}` | {what} | {sensors} | {', '.join(f'`{one}`' for one in estimators(read(root, path), path))} | {purpose} |")
    return "\n".join(parts) + "\n"
