# SPDX-License-Identifier: Apache-2.0
# What the proving tools share: reading a linked ARM image (ELF for the ARM architecture, ARM IHI 0044), the linker's map,
# tables for the reader and JSON for machines. Standard library and arm-none-eabi-binutils only.
import json
import os
import re
import struct
import subprocess
import sys

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.realpath(__file__)), *[os.pardir] * 4))
PREFIX = "arm-none-eabi-"


class ToolError(Exception):
    """A message for the user, without a traceback."""


def run_main(main):
    """Runs main() of a tool: a ToolError becomes one line and exit status 2."""
    try:
        sys.exit(main())
    except ToolError as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def run(*command):
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        raise ToolError(f"{command[0]}: not found; the packages needed are in tools/packages.txt") from None
    if done.returncode != 0:
        raise ToolError(f"{command[0]}: {done.stderr.strip() or done.returncode}")
    return done.stdout


def demangle(names):
    """{mangled: readable} for a collection of symbol names."""
    names = sorted(set(names))
    if not names:
        return {}
    done = subprocess.run([PREFIX + "c++filt"], input="\n".join(names) + "\n", capture_output=True, text=True, check=True)
    return dict(zip(names, done.stdout.split("\n")))


class Section:
    def __init__(self, name, kind, flags, address, size, data):
        self.name, self.kind, self.flags, self.address, self.size, self.data = name, kind, flags, address, size, data
        self.allocated, self.executable, self.writable = bool(flags & 2), bool(flags & 4), bool(flags & 1)
        self.stored = kind != 8  # not SHT_NOBITS


class Symbol:
    """`address` has the Thumb bit of a function cleared, `thumb` notes that it was set."""

    def __init__(self, name, value, size, kind, bind, shndx):
        self.name, self.size, self.bind = name, size, bind
        self.function, self.object, self.untyped, self.file = kind == 2, kind == 1, kind == 0, kind == 4
        self.thumb = self.function and bool(value & 1)
        self.address = value & ~1 if self.function else value
        self.defined, self.absolute, self.shndx = shndx != 0, shndx == 0xFFF1, shndx


class Image:
    """A linked 32-bit little-endian ARM ELF file."""

    def __init__(self, path):
        self.path = path
        self.name = os.path.basename(path)
        for suffix in (".elf", ".axf"):
            self.name = self.name.removesuffix(suffix)
        try:
            with open(path, "rb") as file:
                raw = file.read()
        except OSError as error:
            raise ToolError(f"{path}: {error.strerror}") from None
        if raw[:6] != b"\x7fELF\x01\x01" or len(raw) < 52 or struct.unpack_from("<H", raw, 18)[0] != 40:
            raise ToolError(f"{path}: not a 32-bit little-endian ARM ELF file")
        try:
            self._parse(raw)
        except (struct.error, IndexError, ValueError) as error:
            raise ToolError(f"{path}: damaged ELF file ({error})") from None

    def _parse(self, raw):
        if struct.unpack_from("<H", raw, 16)[0] != 2:
            raise ToolError(f"{self.path}: not a linked image (an object file or a library)")
        self.entry, _, section_offset = struct.unpack_from("<III", raw, 24)
        entry_size, count, names_index = struct.unpack_from("<HHH", raw, 46)
        headers = [struct.unpack_from("<10I", raw, section_offset + i * entry_size) for i in range(count)]

        def text(table, offset):
            start = table + offset
            return raw[start:raw.index(b"\0", start)].decode()

        self.sections, self.symbols = [], []
        for name, kind, flags, address, offset, size, *_ in headers:
            data = b"" if kind == 8 else raw[offset:offset + size]
            self.sections.append(Section(text(headers[names_index][4], name), kind, flags, address, size, data))
        for header, section in zip(headers, self.sections):
            if section.kind != 2:  # SHT_SYMTAB
                continue
            strings = headers[header[6]][4]
            for i in range(0, section.size, 16):
                name, value, size, info, _, shndx = struct.unpack_from("<IIIBBH", section.data, i)
                self.symbols.append(Symbol(text(strings, name), value, size, info & 15, info >> 4, shndx))
        if not self.symbols:
            raise ToolError(f"{self.path}: has no symbol table (stripped)")
        self.symbols = [s for s in self.symbols if s.name and not s.file]
        self.by_name = {s.name: s for s in self.symbols if s.defined}
        profile = next((s for s in self.sections if s.name == ".ARM.attributes"), None)
        attributes = run(PREFIX + "readelf", "-A", self.path) if profile else ""
        self.m_profile = "Tag_CPU_arch_profile: Microcontroller" in attributes
        self.has_fpu = "Tag_FP_arch" in attributes

    def section(self, name):
        return next((s for s in self.sections if s.name == name), None)

    def word(self, address):
        """The 32 bits stored at an address of the image, None outside."""
        for s in self.sections:
            if s.allocated and s.stored and s.address <= address and address + 4 <= s.address + s.size:
                return struct.unpack_from("<I", s.data, address - s.address)[0]
        return None

    def functions(self):
        return [s for s in self.symbols if s.function and s.defined]

    def value(self, name):
        symbol = self.by_name.get(name)
        return None if symbol is None else symbol.address

    def stack_reservation(self):
        """Bytes the linker script keeps for the stack."""
        top, bottom, size = self.value("__stack_top"), self.value("__stack_bottom"), self.value("__stack_size")
        if top is not None and bottom is not None:
            return top - bottom
        if size is not None:
            return size
        raise ToolError(f"{self.path}: the linker script defines neither __stack_bottom and __stack_top nor __stack_size")

    def map_path(self):
        """The linker's map beside the image, or None."""
        for candidate in (os.path.splitext(self.path)[0] + ".map", self.path + ".map"):
            if os.path.exists(candidate):
                return candidate
        return None

    def disassembly(self):
        return run(PREFIX + "objdump", "-d", "--no-show-raw-insn", "-w", self.path)


def map_objects(map_path):
    """Object files of an image as the map names them: 'dir/a.cpp.obj' or 'lib.a(b.cpp.obj)'."""
    with open(map_path, encoding="utf-8", errors="replace") as file:
        text = file.read()
    loads = re.findall(r"^LOAD (\S+)$", text, re.M)
    members = re.findall(r"^ [.\w]\S*\s+(?:0x[0-9a-f]+\s+0x[0-9a-f]+ )(\S+\.a\([^)]+\))$", text, re.M)
    members += re.findall(r"^\s+0x[0-9a-f]+\s+0x[0-9a-f]+ (\S+\.a\([^)]+\))$", text, re.M)
    members += re.findall(r"^(\S+\.a\([^)]+\))$", text, re.M)
    return [x for x in dict.fromkeys(loads + members) if x.endswith((".o", ".obj", ")"))]


def archive_reasons(map_path):
    """{archive member: (who needed it, symbol)} from 'Archive member included to satisfy reference by file (symbol)'."""
    with open(map_path, encoding="utf-8", errors="replace") as file:
        head = file.read().split("\nDiscarded input sections", 1)[0]
    return {m: (by, symbol) for m, by, symbol in re.findall(r"^(\S+\))\s+(\S+) \((\S+)\)$", head, re.M)}


def shorten(readable, most=110):
    """A readable symbol that fits a line: template arguments and parameters that are too long become '...'."""
    while len(readable) > most:
        shorter = re.sub(r"<[^<>]{4,}>", "<...>", readable, count=1)
        shorter = re.sub(r"\([^()]{4,}\)", "(...)", shorter, count=1) if shorter == readable else shorter
        shorter = re.sub(r"<\.\.\.>(?=.*<\.\.\.>)", "<>", shorter, count=1) if shorter == readable else shorter
        if shorter == readable:
            return readable[:most - 3] + "..."
        readable = shorter
    return readable


def table(headings, rows, align=None):
    """Rows as aligned text; columns whose cells are numbers go to the right."""
    cells = [[f"{c:,}".replace(",", " ") if isinstance(c, int) and not isinstance(c, bool) else str(c) for c in row] for row in rows]
    right = [bool(rows) and all(isinstance(r[i], (int, float)) or r[i] in ("", "-") for r in rows) for i in range(len(headings))]
    width = [max([len(h)] + [len(r[i]) for r in cells]) for i, h in enumerate(headings)]
    lines = []
    for row in [list(headings)] + cells:
        lines.append("  ".join(c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, width, right)).rstrip())
    return "\n".join(lines)


def out_path(name, folder=None):
    return os.path.join(folder or os.environ.get("TETAP_OUT", os.path.join(ROOT, "out")), name)


def write_json(name, content, folder=None):
    path = out_path(name, folder)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path + ".new", "w", encoding="utf-8") as file:
        json.dump(content, file, indent=2, sort_keys=True)
        file.write("\n")
    os.replace(path + ".new", path)
    return path


def read_budgets(path=None):
    path = path or os.path.join(ROOT, "tools", "budgets.json")
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except OSError as error:
        raise ToolError(f"{path}: {error.strerror}") from None
    except json.JSONDecodeError as error:
        raise ToolError(f"{path}:{error.lineno}: {error.msg}") from None


def key(result, image):
    """Name of an image in a JSON file; its path when another of that name is there (one robot on several cores)."""
    return image.name if image.name not in result else os.path.relpath(image.path, ROOT)


def add_out_argument(parser):
    parser.add_argument("--out", metavar="DIR", help="folder of the JSON file (default: out/ of the repository)")
