# SPDX-License-Identifier: Apache-2.0
"""A topic as a table (CSV): its time, UTC where it is known, and a column for each number of its messages."""
import itertools

import numpy as np


def columns(topic, utc_us):
    """Heads and arrays, one value a message."""
    found = [("time_s", topic.time_us * 1e-6)]
    if utc_us is not None:
        found.append(("utc_s", (topic.time_us + utc_us) * 1e-6))
    for path, values in {**topic.table, **topic.columns}.items():
        values = np.asarray(values)
        if values.ndim == 2:
            found += [(f"{path}[{i}]", values[:, i]) for i in range(values.shape[1])]
        else:
            found.append((path, np.broadcast_to(values, len(topic))))
    return found


def write(topic, utc_us, path):
    heads, arrays = zip(*columns(topic, utc_us))
    form = ",".join("%.6f" if head in ("time_s", "utc_s") else "%.9f" if head.startswith(("latitude", "longitude")) else "%.9g" for head in heads) + "\n"
    with open(path, "w", encoding="ascii") as file:
        file.write(",".join(heads) + "\n")
        file.writelines(map(form.__mod__, zip(*(array.tolist() for array in arrays))))


def write_status(topics, utc_us, path):
    """Diagnostics: a row for each status."""
    def cell(text):
        return '"%s"' % text.replace('"', '""') if any(c in text for c in ',"') else text
    with open(path, "w", encoding="ascii") as file:
        file.write("time_s," + ("utc_s," if utc_us is not None else "") + "level,name,message,values\n")
        for topic in topics:
            at = "%.6f" % (topic.time_us[0] * 1e-6) + (",%.6f" % ((topic.time_us[0] + utc_us) * 1e-6) if utc_us is not None else "")
            for i in range(topic.given["status"]):
                own = f"status[{i}]."
                values = "; ".join("%s=%s" % (topic.given[f"{own}values[{k}].key"], topic.given[f"{own}values[{k}].value"])
                                   for k in itertools.islice(itertools.count(), topic.given[own + "values"]))
                file.write(",".join([at, str(topic.columns[own + "level"]), *map(cell, (topic.given[own + "name"], topic.given[own + "message"], values))]) + "\n")
