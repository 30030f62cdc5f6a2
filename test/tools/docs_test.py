#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The documentation holds: links and anchors resolve, named targets and tools exist, README and DESIGN keep their lengths, generated pages are fresh, and every
shell line of tutorial and howto runs. What stands behind `sh` of a fence: `data: FOLDER` runs where $TETAP_DATA has it, which DIR stands for; `whole: REASON` runs in
the whole form (form=whole; those of your_robot.md by your_own_test.py, with names of its own); `skip: REASON` is run by the test that the reason names, or by nothing."""
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.docs import bench, campaigns, figures, language, regions, robots, words  # noqa: E402
from tetap.proof import costs  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))
WORLD = os.path.join(PROGRAMS, "tetap-world")
BUILT = os.access(WORLD, os.X_OK)
WHOLE = os.environ.get("form") == "whole"
DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, "..", "shared", "data"))
MOST_WORDS, MOST_LINES, MOST_COLUMNS = 900, 200, 100
MADE = {f"docs/reference/{name}.md" for name in ("messages", "modes_and_faults", "sources", "robots", "parameters", "diagnoses")}  # whole pages of `make docs`


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def pages():
    found = ["README.md", "DESIGN.md", "CHANGELOG.md", "SECURITY.md", "tools/README.md", "sim_host/emulator/README.md", "sim_host/world/README.md", "test/replay/README.md"]
    return found + sorted(os.path.relpath(one, ROOT) for one in glob.glob(os.path.join(ROOT, "docs/**/*.md"), recursive=True))


def without_code(text):
    return re.sub(r"```.*?```", "", text, flags=re.S)


def anchors(text):
    """GitHub's names of the headings: lower case, blanks to dashes, letters, digits, dashes and underscores alone."""
    names = []
    for heading in re.findall(r"^#+ (.*)$", without_code(text), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
        names.append(re.sub(r"[^\w\- ]", "", plain).replace(" ", "-"))
    return names


def broken_links(page, text):
    broken = []
    for link in re.findall(r"\]\(([^)\s]+)\)", without_code(text)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        if not os.path.exists(os.path.join(ROOT, target)):
            broken.append(f"{page}: {link}: no such file")
        elif anchor and target.endswith(".md") and anchor not in anchors(read(target)):
            broken.append(f"{page}: {link}: no such heading")
    return broken


def words_by_hand(page):
    """Words of a page without the tables that `make docs` makes."""
    return len(re.sub(r"<!-- figures: \w+ -->\n.*?<!-- end -->\n", "", read(page), flags=re.S).split())


def blocks(text):
    """(what stands behind `sh`, lines) of each fenced block of shell."""
    return re.findall(r"^```sh[ ]?([^\n]*)\n(.*?)^```", text, re.S | re.M)


class Pages(unittest.TestCase):
    def test_every_relative_link_and_anchor_resolves(self):
        links = 0
        for page in pages():
            text = read(page)
            links += len(re.findall(r"\]\(", text))
            self.assertEqual(broken_links(page, text), [])
        self.assertGreater(links, 100)

    def test_a_broken_link_or_anchor_is_named(self):
        self.assertEqual(broken_links("docs/README.md", "[a](nowhere.md) [b](validation/README.md#nothing) [c](../DESIGN.md#41-the-arrows)"),
                         ["docs/README.md: nowhere.md: no such file", "docs/README.md: validation/README.md#nothing: no such heading"])

    def test_every_page_is_reached_from_the_readme(self):
        reached, todo = set(), ["README.md"]
        while todo:
            page = todo.pop()
            if page in reached:
                continue
            reached.add(page)
            for link in re.findall(r"\]\(([^)#:\s]+\.md)[^)\s]*\)", without_code(read(page))):
                todo.append(os.path.normpath(os.path.join(os.path.dirname(page), link)))
        self.assertEqual(sorted(set(pages()) - reached - {"tools/README.md"}), [])

    def test_every_make_target_that_is_named_exists(self):
        targets = set(re.findall(r"^([a-z_]+):", read("Makefile"), re.M)) | {"docs", "board"}
        for page in pages():
            if page == "CHANGELOG.md":
                continue
            for span in re.findall(r"`make ([^`\n]+)`|^ *make ([^\n#]+)", read(page), re.M):
                named = [word for word in re.split(r"\s+", re.sub(r"""[A-Z_]+=("[^"]*"|'[^']*'|\S*)""", "", (span[0] or span[1]))) if re.fullmatch(r"[a-z_]+", word)]
                self.assertLessEqual(set(named), targets, page)

    def test_every_tool_source_and_test_that_is_named_exists(self):
        for page in pages():
            if page in ("CHANGELOG.md", "docs/howto/recorded_data.md"):  # names of before, names of others
                continue
            text = re.sub(r"^ .* -> .*$", "", read(page), flags=re.M)  # the table of arrows names folders that are to come
            for path in re.findall(r"(?<![\w./-])((?:tools|src|hal|test|config|sim_host|toolchain|drivers)/[\w./-]*\w)", text):
                if re.search(r"[A-Z]{4}|mine|myboard|generated", path):
                    continue  # a name for the reader's own
                self.assertTrue(glob.glob(os.path.join(ROOT, path) + "*"), f"{page}: {path}")

    def test_readme_and_design_keep_their_lengths(self):
        self.assertLessEqual(len(read("README.md").split()), MOST_WORDS)
        self.assertNotIn("NEES", read("README.md"))
        lines = read("DESIGN.md").splitlines()
        self.assertLessEqual(len(lines), MOST_LINES)
        self.assertEqual([line for line in lines if len(line) > MOST_COLUMNS and " -> " not in line], [])  # a row of arrows is one line

    def test_the_pages_that_are_written_by_hand_stay_short(self):
        words_of = {page: words_by_hand(page) for page in pages() if page not in MADE}
        self.assertLessEqual(sum(count for page, count in words_of.items() if page.startswith("docs/")), 48200)  # 45 000, and what came since
        for page, most in (("CHANGELOG.md", 1000), ("docs/validation/shortfalls.md", 2500), ("docs/reference/commands.md", 600), ("docs/tutorial/first_run.md", 600)):
            self.assertLessEqual(words_of[page], most, page)

    def test_a_limit_is_one_line_and_an_attempt_has_at_most_sixty_words(self):
        for line in read("docs/validation/shortfalls.md").split("\n## ", 1)[1].splitlines():
            self.assertRegex(line, r"^(?:\* \*\*.*\.|.*)$" if not line.startswith("*") else r"^\* \*\*\S.*\*\*.*\.$")
            self.assertFalse(line.startswith(" "), line)
        for page in ("README", "tried", "trust"):
            for entry in re.split(r"\n(?=[*|#\n])", read(f"docs/decisions/{page}.md")):
                self.assertLessEqual(len(entry.split()), 60, entry)

    def test_the_time_of_make_test_is_one_figure(self):
        cpu = re.search(r"`make sim` takes \d+ s of CPU, \d+ s of wall; `make test` (\d+) minutes of CPU, \d+ of wall \((commit \w+)\)", read("README.md"))
        self.assertIn(f"takes {cpu[1]} minutes of CPU ({cpu[2]})", read("docs/validation/shortfalls.md"))

    def test_every_row_of_a_table_has_the_columns_of_its_head(self):
        tables = 0
        for page in pages():
            for table in re.findall(r"(?:^\|.*\|$\n?)+", without_code(read(page)), re.M):
                rows = [len(re.findall(r"(?<!\\)\|", re.sub(r"`[^`]*`", "", row))) for row in table.splitlines()]
                self.assertEqual(rows, rows[:1] * len(rows), f"{page}: {table[:200]}")
                tables += 1
        self.assertGreater(tables, 50)

    def test_the_pages_use_the_words_of_the_field(self):
        for page in pages():
            self.assertEqual(re.findall(r"\bcarried (?:off|away)\b|\bthe robot's numbers\b|\bway back\b", read(page)), [], page)

    def test_every_program_is_on_the_page_of_programs_and_describes_itself(self):
        page = read("docs/reference/commands.md")
        tools = sorted(path for path in glob.glob(os.path.join(ROOT, "tools/*/*")) if os.path.isfile(path) and os.access(path, os.X_OK))
        self.assertGreater(len(tools), 40)
        for path in tools:
            with self.subTest(path=os.path.relpath(path, ROOT)):
                self.assertRegex(page, rf"`(?:tools/\w+/)?{os.path.basename(path)}`")
                with open(path, encoding="utf-8") as file:
                    lines = file.read().splitlines()
                if "python" in lines[0]:
                    done = subprocess.run([path, "--help"], capture_output=True, text=True, cwd=ROOT)
                    self.assertEqual((done.returncode, bool(done.stdout.strip())), (0, True), done.stderr)
                else:
                    self.assertTrue([line for line in lines[1:6] if re.match(r"# (?!SPDX|shellcheck)\w", line)])
        programs = re.findall(r"^\| `(tetap-?\w+)` \|", page, re.M)
        mains = glob.glob(os.path.join(ROOT, "sim_host/tetap[_c]*.cpp")) + glob.glob(os.path.join(ROOT, "sim_host/emulator/tetap_*.cpp"))
        self.assertEqual(sorted(programs), sorted(os.path.basename(path)[:-4].replace("_", "-") for path in mains))

    def test_the_functions_cite_the_equations_and_the_equations_name_the_functions(self):
        for page in ("equations", "ekf_slam", "fast_slam", "kalman_forms", "unscented", "particle_filter", "grid_filter", "static_fusion", "pose_grid"):
            rows = re.findall(r"^\| \((\d+)\) \|.*?\| `([^`]+)` in `([^`]+)` \|", read(f"docs/explanation/{page}.md"), re.M)
            self.assertGreater(len(rows), 4)
            self.assertEqual([int(number) for number, _, _ in rows], list(range(1, len(rows) + 1)))
            for number, function, path in rows:
                source = read(path)
                self.assertRegex(source, rf"\b{function.split('::')[-1]}\(", f"({number}): {path} has no {function}")
                cited = set()
                for first, last in re.findall(rf"docs/explanation/{page}\.md,? \((\d+)\)(?: to \((\d+)\))?", re.sub(r"\n\s*///?", "", source)):
                    cited |= set(range(int(first), int(last or first) + 1))
                self.assertIn(int(number), cited, f"{path} does not cite equation ({number}) of {page}.md")


    def test_sentences_are_short_and_name_their_subjects(self):
        spoken = [page for page in pages() if page != "docs/reference/messages.md"]  # its words are those of config/tetap.dbc
        self.assertGreater(sum(len(list(language.sentences(read(page)))) for page in spoken), 800)
        self.assertEqual([one for page in spoken for one in language.findings(page, read(page))], [])

    def test_what_was_before_stands_in_the_decisions_alone(self):
        for page in pages():
            if page != "CHANGELOG.md" and not page.startswith(("docs/decisions/", "docs/reference/")):
                self.assertEqual(re.findall(r"\b(?:before the (?:vote|composition|rule)|used to|formerly|first version)\b", read(page)), [], page)

    def test_the_readme_has_what_a_stranger_looks_for(self):
        page = read("README.md")
        self.assertEqual(re.findall(r"^!\[[^\]]+\]\((\S+)\)", page, re.M), ["sim_host/images/page.png", "docs/images/blocks.svg"])
        parts = {part.split("\n", 1)[0]: part for part in page.split("\n## ")[1:]}
        self.assertEqual(list(parts), ["What it needs", "Two commands", "In your own program", "I want to ...", "Folders", "Status"])
        self.assertIn("doctor", re.findall(r"^\* .*", page, re.M)[0])
        self.assertIn("](docs/explanation/why_not.md)", page)
        folders = {name for cell in re.findall(r"^\| (`.*?`) \| ", parts["Folders"], re.M) for name in re.findall(r"`([\w/]+)`", cell)}
        listed = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True).stdout.split()
        if listed:
            self.assertEqual({name.split("/")[0] for name in folders} | {"toolchain"}, {path.split("/")[0] for path in listed if "/" in path and not path.startswith(".")})
        for need in ("core", "flash and RAM", "sensors"):
            self.assertIn(f"| {need} |", parts["What it needs"])
        self.assertEqual([line.split("  ")[0] for _, lines in blocks(page) for line in lines.splitlines()], ["make sim", "make test"])
        self.assertEqual(len(re.findall(r"^\* \[", parts["I want to ..."], re.M)), 5)
        self.assertLessEqual(len(re.search(r"```cpp\n(.*?)```", parts["In your own program"], re.S)[1].splitlines()), 12)
        self.assertEqual(len(re.findall(r"^\d\. ", parts["Status"], re.M)), 4)
        self.assertIn("](LICENSE)", page)

    def test_a_long_sentence_a_beginning_without_subject_and_speech_are_named(self):
        short = "The gate refuses `a b c d`. A [link of three](x.md) counts as three.\n\n| It | a cell | `code that tells` |\n\n```sh\nIt says\n```\n## What follows\n"
        self.assertEqual(len(language.findings("p", short)), 1)  # the cell
        self.assertEqual(language.findings("p", "one " * 25 + "end. The other is short."), ["p: 26 words: " + "one " * 25 + "end."])
        self.assertEqual(len(language.findings("p", "The fix is far. It is refused.")), 1)
        self.assertEqual(len(language.findings("p", "The bus says so, and the node believes it.")), 2)
        self.assertEqual(language.findings("p", "That line holds. This table has two rows. The set is that of the start."), [])

    def test_every_check_leads_to_a_page(self):
        """A refusal names its check; the page from symptom to cause has each of them, with a link."""
        checks = {word for word, _, _ in words.enumerators(words.read(ROOT, words.SOURCE_STATE), "Check")} - {"None"}
        rows = re.findall(r"^\| ((?:\w+(?:, )?)+) \| [^|]+ \| ([^|]*\]\([^|]*) \|$", read("docs/howto/symptoms.md").split("## Symptoms")[0], re.M)
        self.assertEqual({word for names, _ in rows for word in names.split(", ")}, checks)

    def test_the_state_diagram_has_all_states(self):
        names = [word for word, _, _ in words.enumerators(words.read(ROOT, words.SOURCE_STATE), "SourceState")]
        (diagram,) = re.findall(r"```mermaid\nstateDiagram-v2\n(.*?)```", read("docs/explanation/trust/words.md"), re.S)
        self.assertEqual(set(re.findall(r"\b[A-Z][a-z]+\b", re.sub(r":[^\n]*", "", diagram))), set(names))

    def test_the_memory_of_the_readme_is_that_of_the_cost_page(self):
        flash, ram = re.search(r"^\| Cortex-R5F, rover \| ([\d ]+) \| ([\d ]+) \|", read("docs/validation/cost.md"), re.M).groups()
        kilo = [int(one.replace(" ", "")) / 1000 for one in (flash, ram)]
        self.assertIn(f"| {kilo[0]:.0f} kB and {kilo[1]:.1f} kB with the stack", read("README.md"))

    def test_the_instructions_of_the_readme_are_those_of_the_cost_page(self):
        cells = re.search(r"^\| `node_tick` \| ([\d ]+) / ([\d ]+) \| ([\d ]+) / ([\d ]+) \|", read("docs/validation/cost.md"), re.M).groups()
        m7, _, m4f, worst = [round(int(one.replace(" ", "")) / 1000) for one in cells]
        self.assertIn(f"| {m7} 000 instructions a tick of 10 ms on M7, {m4f} 000 on M4F, at worst {worst} 000;", read("README.md"))


class Generated(unittest.TestCase):
    def test_the_pages_of_the_reference_are_fresh(self):
        done = subprocess.run([os.path.join(ROOT, "tools/report/write_docs"), "--check", "--programs", PROGRAMS], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_the_bus_load_of_the_pages_is_that_of_the_database(self):
        done = subprocess.run([os.path.join(ROOT, "tools/can/generate_messages"), "config/tetap.dbc", "--load"], cwd=ROOT, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        load = {name: cells for name, *cells in re.findall(r"^(\w.*?\w)  +\d+ +(\d+) +([\d.]+) %", done.stdout, re.M)}
        (frames, share), (most, full) = load["what the node sends by default"], load["every sensor on the bus, IMU at 100 Hz"]
        page = " ".join(read("docs/validation/cost.md").split())
        self.assertIn(f"{frames} frames/s by default, {share} % of 500 kbit/s", page)
        self.assertIn(f"{most} frames/s, {full} % of an allowed 40 %", page)
        self.assertIn(f"at most {frames} frames/s by default, {float(share):.0f} % of 500 kbit/s", " ".join(read("docs/tutorial/first_run.md").split()))

    def test_a_word_without_advice_and_advice_without_a_word_are_errors(self):
        with tempfile.TemporaryDirectory() as tree:
            for path in (words.VOCABULARY, words.ADVICE):
                os.makedirs(os.path.dirname(os.path.join(tree, path)), exist_ok=True)
                shutil.copy(os.path.join(ROOT, path), os.path.join(tree, path))
            self.assertIn("| Nominal | 3 |", words.modes_and_faults(tree))
            vocabulary, advice = read(words.VOCABULARY), read(words.ADVICE)
            for name, text, said in ((words.VOCABULARY, vocabulary.replace("kFindingHeading = 9,", "kFindingHeading = 9,\n  kLost = 10,"), "Mode::kLost has no line"),
                                     (words.ADVICE, advice + "Fault\tHungry\tNo food.\tEat.\n", "Fault Hungry is no word"),
                                     (words.ADVICE, advice + "Fault\tWheelSlip\n", "expected enum, word, meaning")):
                with self.subTest(said=said):
                    with open(os.path.join(tree, name), "w", encoding="utf-8") as file:
                        file.write(text)
                    with self.assertRaisesRegex(words.WordError, said):
                        words.modes_and_faults(tree)
                    shutil.copy(os.path.join(ROOT, name), os.path.join(tree, name))

    def test_every_robot_that_is_shipped_is_on_the_page_of_robots(self):
        done = subprocess.run(["git", "-C", ROOT, "ls-files", "config/*.hpp"], capture_output=True, text=True)
        shipped = [os.path.basename(path)[:-len(".hpp")] for path in done.stdout.split() if os.path.dirname(path) == "config"]
        page = robots.robots(ROOT)
        rows = {robot: names for robot, names in re.findall(r"^\| `(\w+)` \| [^|]+ \| [^|]+ \| ([^|]+) \| [^|]+ \|$", page, re.M)}
        self.assertEqual(sorted(rows), sorted(shipped) if done.returncode == 0 else sorted(rows))
        self.assertEqual(rows["rover"], "`Odometry`, `Attitude`, `WatchedInertial`")
        self.assertEqual(rows["husky"], "`Odometry`, `PoseEkf`")
        self.assertEqual(rows["mrclam_pf"], "`Odometry`, `PoseParticles<1000>`")
        self.assertEqual(rows["mrclam_grid"], "`Odometry`, `PoseGrid<16, 32, 48>`")
        self.assertEqual(rows["fusion2"], "`PositionFusion<InverseVariance>`, `PositionFusion<Intersection>`")

    def test_a_robot_that_is_listed_and_not_there_is_an_error(self):
        with tempfile.TemporaryDirectory() as tree:
            os.makedirs(os.path.join(tree, "docs/reference"))
            shutil.copytree(os.path.join(ROOT, "config"), os.path.join(tree, "config"))
            os.remove(os.path.join(tree, "config/car.hpp"))
            for text, reason in ((read(robots.LIST), "car is no robot"), ("husky\ta\tb\tc\nhusky\ta\tb\tc\n", "2: husky stands twice"), ("husky\ta\tb\n", "expected robot, what")):
                with open(os.path.join(tree, robots.LIST), "w", encoding="utf-8") as file:
                    file.write(text)
                with self.assertRaisesRegex(words.WordError, reason):
                    robots.robots(tree)

    def test_sources_states_and_checks_are_read_from_the_headers(self):
        with tempfile.TemporaryDirectory() as tree:
            os.makedirs(os.path.join(tree, "src/tetap/sensor"))
            os.makedirs(os.path.join(tree, words.SOURCES))
            with open(os.path.join(tree, words.SOURCE_STATE), "w", encoding="utf-8") as file:
                file.write("enum class SourceState : std::uint8_t {\n  kStopped,  ///< silent\n  kFusing,\n  kRejecting,  ///< refused\n};\n"
                           "enum class Check : std::uint8_t {\n  kNone,\n  kGate,  ///< innovation gate\n};\n")
            with open(os.path.join(tree, words.SOURCES, "radar_range.hpp"), "w", encoding="utf-8") as file:
                file.write("status_.rejecting(Check::kGate);")
            with open(os.path.join(tree, os.path.dirname(words.SOURCES), "fuse.cpp"), "w", encoding="utf-8") as file:
                file.write("void Inertial::other(int a) {\n  Check::kOther;\n}\nInnovation Inertial::fuse(const sensor::ImuSample& s) {\n  Check::kGate;\n}\n")
            page = words.sources(tree)
            self.assertIn("Its samples are tested for Gate.", page)
            self.assertIn("| Stopped | 0 | silent |", page)
            self.assertIn("| Rejecting | 2 | refused |", page)
            self.assertIn("| radar range | x |  | x | Gate |", page)

    def test_figures_come_from_out_and_stay_where_a_file_is_missing(self):
        with tempfile.TemporaryDirectory() as out:
            with open(os.path.join(out, "count.json"), "w", encoding="utf-8") as file:
                json.dump({"m7": {"w1_kf": 959, "node_tick": 58270}, "r5": {"w1_kf": 900}}, file)
            first = figures.page(out, "")
            self.assertIn("| node_tick | 58 270 | - |", first)
            self.assertIn("`make count`", first)
            os.remove(os.path.join(out, "count.json"))
            self.assertEqual(figures.page(out, first), first)

    def test_figures_beside_objects_have_a_table_of_their_own(self):
        page = figures.of_flat({"lives": 1086, "worst": 2.99, "attacks": {"drop": {"lives": 68}, "flip": {"lives": 67}}, "first": []})
        self.assertIn("| lives | 1 086 |\n| worst | 2.99 |\n\nattacks:\n\n|  | lives |", page)
        self.assertIn("| flip | 67 |", page)

    def test_every_estimator_of_the_filters_has_a_row_of_costs_and_every_row_a_header(self):
        """A header of src/tetap/filter is an estimator of the table, or a part that this list names."""
        parts = {"attitude_bias", "attitude_clipping", "attitude_heading", "attitude_options", "big_covariance", "condition", "correction", "covariance_access", "fault_signature", "inverse",
                 "kalman_form", "linear_models", "low_pass", "particle_noise", "particle_number", "particle_pose", "pose_cloud", "quaternion", "resampling", "root_update", "sigma_points",
                 "sparse_update", "state", "structure", "symmetric", "triangular", "unroll", "update", "viewed", "whole_covariance", "wrap"}
        rows = costs.listed(read("test/costs/list.hpp"))
        headers = {os.path.basename(path)[:-4] for path in glob.glob(os.path.join(ROOT, "src/tetap/filter/*.hpp"))}
        of_rows = {os.path.basename(header)[:-4] for _, _, header in rows if header.startswith("tetap/filter/")}
        self.assertEqual(headers - parts, of_rows)
        self.assertLessEqual(parts, headers)
        self.assertEqual([header for _, _, header in rows if not os.path.exists(os.path.join(ROOT, "src", header))], [])
        sizes = {}
        for name, size, _ in rows:
            sizes.setdefault(name, []).append(size)
        self.assertEqual({name for name, of in sizes.items() if len(of) != 2 or not of[0] < of[1]}, {"complementary"})  # one axis is all it has
        table = re.search(r"<!-- figures: costs -->\n(.*?)<!-- end -->", read("docs/explanation/which_estimator.md"), re.S)[1]
        shown = [(name, int(size.replace(" ", ""))) for name, size in re.findall(r"^\| (\w+) \| [^|]* \| ([\d ]*\d)[^|]* \|", table, re.M) if name != "filter"]
        self.assertEqual(shown, [(name, size) for name, size, _ in rows])

    def test_a_row_of_costs_has_what_its_filter_adds_and_how_that_grows(self):
        accuracy = [{"filter": "ekf", "size": size, "header": "filter/ekf.hpp", "scenario": "odometry", "grows": "states", "rmse_m": 0.1, "nees": 3.1, "nees_dof": 3, "seeds": 50}
                    for size in (3, 5)] + [{"filter": "one", "size": 1, "header": "h", "scenario": "gyroscope", "grows": "axes", "rmse_deg": 0.5, "seeds": 20}]
        count = {"ekf_3": 800, "ekf_5": 2000, "one_1": 100}
        rows = costs.rows_of(accuracy, {"ekf_3": 40, "ekf_5": 100, "one_1": 16}, {"none_0": 9000, "none_1": 8000, "ekf_3": 11500, "ekf_5": 14000, "one_1": 8400},
                             {"ekf_3": 200, "ekf_5": 400, "one_1": 50}, {"m7": count, "m4f": count, "r5": count})
        self.assertEqual([(row["flash_b"], row["m7"], row["grows_with"]) for row in rows],
                         [(2500, 800, "states 3 to 5: M7 x 2.5, RAM x 2.5"), (5000, 2000, "states 3 to 5: M7 x 2.5, RAM x 2.5"), (400, 100, "one size")])
        self.assertEqual(costs.cells(rows)[1][:5], ["ekf", "odometry", "5 states", "0.100 m", "3.1, 3"])

    def test_a_bar_that_is_missed_is_named(self):
        report = {"benchmarks": [{"run_name": f"{workload}/{name}", "aggregate_name": aggregate, "items_per_second": value} for (workload, name), ns in
                                 {("kalman", "tetap"): 20, ("kalman", "textbook"): 30, ("kalman", "opencv"): 2000, ("kalman", "bfl"): 2100, ("ekf", "tetap"): 40, ("ekf", "textbook"): 80,
                                  ("ekf", "opencv"): 4000, ("ekf", "bfl"): 4100, ("pose_graph", "tetap"): 61e6, ("pose_graph", "ceres"): 33e6}.items()
                                 for aggregate, value in (("median", 1e9 / ns), ("cv", 0.02))]}
        rows = bench.rows_of(report)
        self.assertEqual({(one["workload"], one["implementation"]): round(one["times"], 3) for one in rows}[("kalman", "textbook")], 1.5)
        self.assertEqual(bench.missed(rows), ["Kalman step, 4 states, 2 measured: textbook Eigen takes 1.50 times as long, 2 are asked for",
                                              "pose graph M3500: tetap takes 61.0 ms, at most 60 are asked for"])

    def test_every_region_of_the_pages_is_known_and_named_with_its_command(self):
        found = {}
        for page in pages():
            for name, body in re.findall(r"<!-- figures: (\w+) -->\n(.*?)<!-- end -->", read(page), re.S):
                found[name] = page
                self.assertIn(name, regions.REGIONS, page)
                self.assertTrue(body.startswith(f"`{regions.REGIONS[name][0]}`"), f"{page}: {name}")
        self.assertLessEqual({"memory", "instructions", "bench", "estimators", "costs", "campaign", "drives", "mrclam"}, set(found))

    def test_the_ledger_has_every_table_and_keeps_what_has_no_file(self):
        with tempfile.TemporaryDirectory() as out:
            self.assertNotIn("## Table", regions.ledger(out, "", ""))
            for name, content in (("size", {"flash": 225096, "ram": 16472}), ("stack", {"bound": 2672})):
                with open(os.path.join(out, f"{name}.json"), "w", encoding="utf-8") as file:
                    json.dump({"tetap-zynqmp_r5-rover": content}, file)
            with open(os.path.join(out, "swarm.json"), "w", encoding="utf-8") as file:
                json.dump({name: 7 for name in ("seeds", "ok", "named", "blind", "silent", "unsafe", "pairs", "pairs_reached", "values", "values_reached")}, file)
            with open(os.path.join(out, "mutants.json"), "w", encoding="utf-8") as file:
                json.dump({"rows": [{"noticed": True}, {"noticed": False, "file": "a.hpp", "line": 3, "literal": "4", "factor": 0.5}]}, file)
            first = regions.ledger(out, "", "")
            self.assertIn("## Table memory", first)
            self.assertIn("| silent | 7 |", first)
            self.assertIn("1 of 2 mutants are noticed", first)
            self.assertIn("| `a.hpp:3` | `4` | 0.5 |", first)
            self.assertNotIn("## Table instructions", first)
            for name in ("size", "swarm", "mutants"):
                os.remove(os.path.join(out, f"{name}.json"))
            self.assertEqual(regions.ledger(out, first, ""), first)

    def test_a_table_of_all_cuts_stays_where_the_file_has_some(self):
        page = "<!-- figures: nees -->\nold\n<!-- end -->\n"
        with tempfile.TemporaryDirectory() as out:
            with open(os.path.join(out, "inertial.json"), "w", encoding="utf-8") as file:
                json.dump({"car": {"outages": []}, "px4": {}, "husky": {}}, file)
            self.assertEqual(regions.fill(page, out, ""), page)

    def test_a_table_of_a_campaign_is_made_of_its_very_command_alone(self):
        spread = {"median": 0.104, "worst": 0.226}
        case = {"label": "matched, wheel_spin", "seeds": 100, "said_after_s": {"median": 0.34, "worst": 0.4},
                "fused": {"largest_error_m": spread, "position_rmse_after_m": None, "error_over_3_sigma": {"median": 0.4, "worst": 1.256}, "too_sure_seeds": 7}}
        page = "<!-- figures: slip -->\nold\n<!-- end -->\n"
        with tempfile.TemporaryDirectory() as out:
            os.makedirs(os.path.join(out, "campaigns/slip"))
            for words_of, made in (("--scenario slip --seeds 3 --out out/campaigns/slip", False), ("--scenario slip --seeds 100", False),
                                   ("--scenario slip --seeds 100 --out out/campaigns/slip --jobs 1", True)):
                with open(os.path.join(out, "campaigns/slip/campaign.json"), "w", encoding="utf-8") as file:
                    json.dump({"command": f"tools/proof/run_campaign {words_of}", "cases": [case]}, file)
                filled = regions.fill(page, out, "")
                if made:
                    self.assertIn("| matched, wheel_spin | 0.3 s | 0.10 / 0.23 m | - | 1.26 | 7 of 100 |", filled)
                else:
                    self.assertEqual(filled, page)

    def test_every_campaign_of_a_page_is_one_that_the_program_takes(self):
        """Its words are parsed by run_campaign itself, up to where it would build."""
        for one in campaigns.REGIONS.values():
            for shown in one[0].split(" && "):
                self.assertTrue(shown.startswith(campaigns.PROGRAM + " --"), shown)
                done = subprocess.run([os.path.join(ROOT, campaigns.PROGRAM), *shown.split()[1:], "--jobs", "0"], capture_output=True, text=True)
                self.assertIn("must be 1 or more", done.stderr, shown)

    def test_a_marked_table_is_made_from_its_files_and_stays_where_one_is_missing(self):
        page = "Before.\n<!-- figures: memory -->\nold\n<!-- end -->\nAfter.\n"
        with tempfile.TemporaryDirectory() as out:
            self.assertEqual(regions.fill(page, out, ""), page)
            for name, content in (("size", {"flash": 225096, "ram": 16472}), ("stack", {"bound": 2672, "measured": 2224})):
                with open(os.path.join(out, f"{name}.json"), "w", encoding="utf-8") as file:
                    json.dump({"tetap-zynqmp_r5-rover": content}, file)
            made = regions.fill(page, out, "")
            self.assertIn("`make size stack`:\n\n", made)
            self.assertIn("| Cortex-R5F, rover | 225 096 | 16 472 | 2 672 | 2 224 |", made)
            self.assertTrue(made.startswith("Before.\n") and made.endswith("<!-- end -->\nAfter.\n"))


@unittest.skipUnless(BUILT, "tetap-world is not built")
class Lines(unittest.TestCase):
    """Every shell line of tutorial and howto, in a copy of the tree with the programs that are built."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = os.path.join(folder.name, "tetap")
        shutil.copytree(ROOT, self.tree, symlinks=True, ignore=lambda where, _: {"build", "out", ".git"} if where == ROOT else ())
        os.makedirs(os.path.join(self.tree, "build/host"))
        os.symlink(PROGRAMS, os.path.join(self.tree, "build/host/sim_host"))
        # The programs are there already: packages and builds are other steps' matter.
        self.without("install_packages", "build_preset")

    def without(self, *tools):
        for tool in tools:
            with open(os.path.join(self.tree, "tools/run", tool), "w", encoding="utf-8") as file:
                file.write("#!/bin/sh\n")

    def run_here(self, line, **more):
        environment = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "OUT")}
        environment |= {"TETAP_PROGRAMS": PROGRAMS, "BUS": "memory", "REPORT": "--no-pictures", **more}
        done = subprocess.run(["bash", "-eu", "-o", "pipefail", "-c", line], cwd=self.tree, env=environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        return done.stdout

    def save_programs(self, page):
        for name, code in re.findall(r"Save this as `(\w+\.cpp)`:\n\n```cpp\n(.*?)```", read(page), re.S):
            with open(os.path.join(self.tree, name), "w", encoding="utf-8") as file:
                file.write(code)

    def test_every_line_of_tutorial_and_howto_runs(self):
        ran = 0
        for page in pages():
            if not page.startswith(("docs/tutorial/", "docs/howto/")):
                continue
            text = read(page)
            self.assertEqual(len(re.findall(r"^```(?:sh|bash|console|shell)", text, re.M)), len(blocks(text)), page)
            self.save_programs(page)
            for how, lines in blocks(text):
                data = re.fullmatch(r"data: (\S+)", how)
                if data and not os.path.isdir(os.path.join(DATA, data[1])):
                    continue
                if how and not data:
                    self.assertRegex(how, r"\A(skip|whole): \S.{10,}", f"{page}: why does this block not run?")
                    continue
                if data:
                    lines = re.sub(r"\bDIR\b", os.path.join(DATA, os.path.dirname(data[1])), lines)
                for line in lines.splitlines():
                    with self.subTest(page=page, line=line):
                        # What its reader runs to the end is shortened, but for the drive that shows each word of the tutorial.
                        self.run_here(line, **({} if line == "make sim" else {"WORLD": "--duration 20"}))
                        ran += 1
        self.assertGreater(ran, 12)

    def test_a_block_is_left_out_with_one_of_the_known_reasons_alone(self):
        left = [(page, how) for page in pages() if page.startswith(("docs/tutorial/", "docs/howto/")) for how, _ in blocks(read(page)) if how.startswith("skip: ")]
        self.assertEqual([page for page, _ in left], ["docs/howto/find_a_mistake.md", "docs/tutorial/first_run.md"], left)
        for _, how in left:
            for test in re.findall(r"test/\S+", how):
                self.assertTrue(os.path.exists(os.path.join(ROOT, test)), how)

    @unittest.skipUnless(WHOLE, "builds: whole form alone")
    def test_every_line_that_builds_runs_in_the_whole_form(self):
        shutil.copy(os.path.join(ROOT, "tools/run/build_preset"), os.path.join(self.tree, "tools/run/build_preset"))
        shutil.rmtree(os.path.join(self.tree, "build"))
        ran = 0
        for page in pages():
            if not page.startswith(("docs/tutorial/", "docs/howto/")) or page == "docs/tutorial/your_robot.md":
                continue
            self.save_programs(page)
            for how, lines in blocks(read(page)):
                for line in lines.splitlines() if how.startswith("whole: ") else ():
                    with self.subTest(page=page, line=line):
                        self.run_here(line)
                        ran += 1
        self.assertGreater(ran, 0)

    def tutorial_programs(self, page="docs/tutorial/your_filter.md", names=("example", "beacon", "corridor")):
        """[(name, lines of code, command, output)] of a page; each file is written."""
        found = re.findall(r"Save this as `(\w+)\.cpp`:\n\n```cpp\n(.*?)```.*?```sh\n(g\+\+ [^\n]*)\n.*?```text\n(.*?)```", read(page), re.S)
        self.assertEqual([name for name, *_ in found], list(names))
        for name, code, *_ in found:
            with open(os.path.join(self.tree, name + ".cpp"), "w", encoding="utf-8") as file:
                file.write(code)
        return [(name, [line for line in code.splitlines() if line.strip()], command, printed) for name, code, command, printed in found]

    def compile_and_run(self, programs):
        for name, _, command, printed in programs:
            for compiler in ("g++", "clang++"):
                with self.subTest(name=name, compiler=compiler):
                    self.run_here(command.replace("g++", compiler, 1) + " -Wall -Wextra -Werror")
                    self.assertEqual(self.run_here(f"./{name}"), printed)

    def test_the_motion_model_of_the_tutorial_compiles_with_both_compilers_and_prints_what_stands_below_it(self):
        self.compile_and_run(self.tutorial_programs("docs/tutorial/your_motion_model.md", ["bicycle"]))

    def test_the_code_of_the_readme_compiles_with_both_compilers_and_accepts_its_measurement(self):
        with open(os.path.join(self.tree, "track.cpp"), "w", encoding="utf-8") as file:
            file.write(re.search(r"```cpp\n(.*?)```", read("README.md"), re.S)[1])
        command = re.search(r"`(g\+\+ [^`]* track\.cpp)`", read("README.md"))[1]
        for compiler in ("g++", "clang++"):
            self.run_here(command.replace("g++", compiler, 1) + " -Wall -Wextra -Werror -o track")
            x, nis, gate = map(float, re.fullmatch(r"x ([\d.]+) m, NIS ([\d.]+) of at most ([\d.]+)\n", self.run_here("./track")).groups())
            # By hand: P- = 100 + 0.01 4 and R = 0.09 in x, y alike, so x = 3 P/(P + R) and NIS = (9 + 25)/(P + R).
            self.assertAlmostEqual(x, 3 * 100.04 / 100.13, delta=0.01)
            self.assertAlmostEqual(nis, 34 / 100.13, delta=0.01)
            self.assertAlmostEqual(gate, 9.21, delta=0.01)

    def test_the_filters_of_the_tutorial_compile_with_both_compilers_and_print_what_stands_below_them(self):
        for name, lines, *_ in self.tutorial_programs():
            self.assertTrue(20 <= len(lines) <= 30, f"{name}: {len(lines)} lines")
        self.compile_and_run(self.tutorial_programs())

    @unittest.skipUnless(shutil.which("arm-none-eabi-g++"), "no compiler for ARM")
    def test_the_filters_of_the_tutorial_link_for_small_cores_and_allocate_nothing(self):
        small = "-mthumb -Os -fno-exceptions -fno-rtti -fno-threadsafe-statics -DEIGEN_NO_DEBUG -DEIGEN_NO_MALLOC"
        for name, *_ in self.tutorial_programs():
            for core in ("-mcpu=cortex-m0plus", "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard"):
                with self.subTest(name=name, core=core):
                    self.run_here(f"arm-none-eabi-g++ -std=c++20 -Isrc -isystem /usr/include/eigen3 {small} {core} -c {name}.cpp -o {name}.o")
                    wanted = self.run_here(f"arm-none-eabi-nm -u {name}.o").split()
                    self.assertIn("printf", wanted)
                    self.assertEqual([one for one in wanted if re.search(r"alloc|_Zn[wa]|_Zd[la]|cxa|throw|sinf|cosf|expf|logf", one)], [])
                    self.run_here(f"arm-none-eabi-g++ {core} -mthumb {name}.o -specs=nano.specs -specs=nosys.specs -o {name}.elf")

    def quoted_lines_are_those_of_the_run(self, summary):
        """Figures and lines of first_run.md against the run that it describes: every word of a quoted line is in the first line that its grep finds."""
        page = read("docs/tutorial/first_run.md")
        fused = summary["fused"]
        self.assertIn(f"A NEES of {fused['nees_mean']:.2f} means a covariance that is too large", page)
        self.assertIn(f"*Odometry* (wheels and gyroscope) is {summary['odometry']['max_error_m']:.1f} m off at the worst,", page)
        self.assertIn(f"*fused* (IMU, wheels and GNSS) {fused['max_error_m']:.1f} m.", page)
        self.run_here("tools/can/decode_log out/sim/raw.log > out/sim/raw.txt")
        commands = re.findall(r"^(grep -m 1 .*)$", page, re.M)
        quoted = re.search(r"The three lines read like this.*?```text\n(.*?)```", page, re.S)[1].splitlines()
        self.assertEqual((len(commands), len(quoted)), (3, 3))
        for command, line in zip(commands, quoted):
            found = self.run_here(command).split()
            self.assertEqual([word for word in line.split() if word not in found], [], f"{command}: {' '.join(found)}")

    def test_the_robot_of_the_tutorial_compiles_with_both_compilers_and_has_noise_of_its_wheels(self):
        code = re.search(r"Save this as `config/mine.hpp`:\n\n```cpp\n(.*?)```", read("docs/tutorial/your_robot.md"), re.S)[1]
        with open(os.path.join(self.tree, "config/mine.hpp"), "w", encoding="utf-8") as file:
            file.write(code)
        with open(os.path.join(self.tree, "robot.cpp"), "w", encoding="utf-8") as file:
            file.write('#include "config/mine.hpp"\n#include <memory>\nnamespace r = tetap::robot::mine;\nusing Node = tetap::node::Node<r::Estimators>;\n'
                       "std::unique_ptr<Node> f(const tetap::bus::Version& v) { return std::make_unique<Node>(r::parameters, v); }\n"
                       "static_assert(r::parameters.wheels.drive.noise_left > 0 && r::parameters.wheels.drive.noise_right > 0);\n")
        os.makedirs(os.path.join(self.tree, "made/tetap/bus"))
        self.run_here("tools/can/generate_messages --header made/tetap/bus/messages.hpp")
        for compiler in ("g++", "clang++"):
            self.run_here(f"{compiler} -std=c++20 -fsyntax-only -Wall -Wextra -Werror -Wno-missing-field-initializers -I. -Isrc -Imade -isystem /usr/include/eigen3 robot.cpp")

    def test_the_estimator_of_extend_is_one_that_a_node_takes(self):
        code = re.search(r"Save it as `gnss_track.hpp` in `src/tetap/estimators`:\n\n```cpp\n(.*?)```", read("docs/howto/extend.md"), re.S)[1]
        with open(os.path.join(self.tree, "src/tetap/estimators/gnss_track.hpp"), "w", encoding="utf-8") as file:
            file.write(code)
        with open(os.path.join(self.tree, "robot.cpp"), "w", encoding="utf-8") as file:
            file.write('#include "tetap/estimators/gnss_track.hpp"\n#include "tetap/node/node.hpp"\n#include "tetap/param/limits.hpp"\n#include <memory>\n'
                       "using namespace tetap;\nusing Node = node::Node<node::Estimators<estimators::GnssTrack>>;\n"
                       "static_assert(node::EstimatorSlot<estimators::GnssTrack>::kTakes<sensor::GnssPosition>);\n"
                       "constexpr param::Parameters parameters = param::checked({.gnss = {.sigma_floor_m = 1.0F}});\n"
                       "std::unique_ptr<Node> f(const bus::Version& v) { return std::make_unique<Node>(parameters, v); }\n")
        os.makedirs(os.path.join(self.tree, "made/tetap/bus"))
        self.run_here("tools/can/generate_messages --header made/tetap/bus/messages.hpp")
        for compiler in ("g++", "clang++"):
            self.run_here(f"{compiler} -std=c++20 -fsyntax-only -Wall -Wextra -Werror -Wno-missing-field-initializers -I. -Isrc -Imade -isystem /usr/include/eigen3 robot.cpp")

    def summary_of(self, seed):
        self.run_here(f"make sim SEED={seed} OUT=out/seed{seed}")
        with open(os.path.join(self.tree, f"out/seed{seed}/summary.json"), encoding="utf-8") as file:
            return json.load(file)

    def test_the_table_of_the_readme_has_the_median_and_the_ends_of_thirty_seeds(self):
        """The whole form drives all seeds; the short one the best and the worst in position, and one whose every figure has to lie between the ends."""
        rows = {what: [[float(one) for one in re.fullmatch(r"([\d.]+) \w+ \(([\d.]+) to ([\d.]+)\)", cell).groups()] for cell in cells]
                for what, *cells in re.findall(r"^\| ((?:position|heading|largest) [^|]+) \| ([^|]+) \| ([^|]+) \|$", read("README.md"), re.M)}
        summaries = {seed: self.summary_of(seed) for seed in (range(1, 31) if WHOLE else (1, 11, 7))}
        for what, key in (("position error, RMS", "position_rmse_m"), ("heading error, RMS", "heading_rmse_deg"), ("largest position error", "max_error_m")):
            for name, (median, least, most) in zip(("odometry", "fused"), rows[what]):
                found = sorted(one[name][key] for one in summaries.values())
                self.assertGreaterEqual(found[0], least - 0.005)
                self.assertLessEqual(found[-1], most + 0.005)
                if WHOLE:
                    self.assertAlmostEqual(found[0], least, delta=0.0051)
                    self.assertAlmostEqual(found[-1], most, delta=0.0051)
                    self.assertAlmostEqual((found[14] + found[15]) / 2, median, delta=0.0051)
        fused = rows["position error, RMS"][1]
        self.assertEqual([round(summaries[seed]["fused"]["position_rmse_m"], 2) for seed in (1, 11)], fused[1:])
        shutil.copytree(os.path.join(self.tree, "out/seed1"), os.path.join(self.tree, "out/sim"))
        self.quoted_lines_are_those_of_the_run(summaries[1])

    def test_the_faults_that_are_counted_are_those_there_are(self):
        def printed(*options):
            return subprocess.run([WORLD, *options], check=True, capture_output=True, text=True).stdout

        every = re.findall(r"^  ([a-z_]+) +@", printed("--help"), re.M)
        self.assertEqual(int(re.search(r"\* (\d+) faults and their times", read("docs/tutorial/first_run.md"))[1]), len(every))
        page = read("docs/validation/shortfalls.md")
        others = re.search(r"in the other (\d+) faults that act on a rover", " ".join(page.lower().split()))[1]
        named = {fault for bullet in re.findall(r"^\* (.*?)(?=^\* |^##|\Z)", page, re.M | re.S) for fault in every if f"`{fault}`" in bullet}
        self.assertEqual(int(others), len(set(printed("--list-faults").split()) - named))


if __name__ == "__main__":
    unittest.main()
