# SPDX-License-Identifier: Apache-2.0
# Follows the stack pointer through the machine code of a linked image: what each function uses at each call, whom it calls, where it
# returns. Instructions as objdump prints them; ARM DDI 0403 (ARMv7-M) and DDI 0406 (ARMv7-A and -R) define their effect on sp.
import bisect
import re

CONDITIONS = ("eq", "ne", "cs", "hs", "cc", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le")
CONDITIONAL = {root + c: (root, c) for root in ("b", "bl", "bx", "blx", "pop", "push", "add", "sub", "mov", "ldr", "ldm", "ldmia", "ldmfd",
                                                "vpop", "vldmia", "str", "strd", "stmdb", "stmfd", "vpush", "adds", "subs", "addw", "movs")
               for c in CONDITIONS}
# Both are unconditional: "bls" is branch if lower or same, not a call, and so on; "bl" + condition is a call where "b" + condition is not.
CONDITIONAL.update({"b" + c: ("b", c) for c in CONDITIONS})
WRITES_NOTHING = re.compile(r"^(str|stm|cmp|cmn|tst|teq|vstr|vstm|vcmp|vpush|push|b$|bx|bl$|blx|it|nop|cb|tb|dsb|dmb|isb|msr|pld|udf|bkpt|svc|"
                            r"wf|sev|cps|mcr|vmsr|yield)")
LITERAL = re.compile(r"[@;] ?\(?(?:0x)?([0-9a-f]+)\b")


class Instruction:
    __slots__ = ("address", "root", "condition", "operands", "next", "literal", "adr", "target")

    def __init__(self, address, mnemonic, text):
        mnemonic = mnemonic.removesuffix(".n").removesuffix(".w")
        self.address, self.next = address, None
        self.root, self.condition = CONDITIONAL.get(mnemonic, (mnemonic, None))
        comment = re.search(r"\s*[@;].*$", text)
        self.operands = text[:comment.start()] if comment else text
        self.literal = None
        if "[pc" in self.operands and comment and self.root in ("ldr", "ldrd"):
            found = LITERAL.search(comment.group())
            self.literal = int(found.group(1), 16) if found else None
        adr = re.search(r"\(adr \w+, ([0-9a-f]+)", comment.group()) if comment else None
        self.adr = int(adr.group(1), 16) if adr else None
        place = re.match(r"(?:\w+, )?([0-9a-f]+) <", self.operands) if self.root in ("b", "bl", "blx", "cbz", "cbnz") else None
        self.target = int(place.group(1), 16) if place else None

    def __str__(self):
        return f"{self.address:#x}: {self.root}{self.condition or ''} {self.operands}"


def registers(text):
    """Number of names in '{r4, r5, lr}', bytes in it and the names; d registers are 8 bytes wide."""
    names = []
    for part in text.strip("{}^ ").split(","):
        part = part.strip()
        span = re.fullmatch(r"([rsd])(\d+)-[rsd](\d+)", part)
        names += [f"{span[1]}{i}" for i in range(int(span[2]), int(span[3]) + 1)] if span else [part]
    return sum(8 if n[0] == "d" and n[1:].isdigit() else 4 for n in names), names


class Problem(Exception):
    """Machine code of unknown stack use."""


class Code:
    """The instructions of an image and its function symbols."""

    def __init__(self, image):
        self.image = image
        self.instructions = {}
        last = None
        for line in image.disassembly().splitlines():
            found = re.match(r"^\s*([0-9a-f]+):\t(\S+)(?:\t(.*))?$", line)
            if not found or found.group(2).startswith("."):
                last = None if found else last
                continue
            instruction = Instruction(int(found.group(1), 16), found.group(2), (found.group(3) or "").strip())
            self.instructions[instruction.address] = instruction
            if last is not None:
                last.next = instruction.address
            last = instruction
        executable = {i for i, s in enumerate(image.sections) if s.executable}
        names = {}
        for s in image.symbols:
            label = s.untyped and s.shndx in executable and not s.name.startswith("$") and s.address in self.instructions
            if s.defined and (s.function or label):
                names.setdefault(s.address, []).append(s)
        self.starts = sorted(names)
        self.names = {a: [s.name for s in sorted(symbols, key=lambda s: (s.untyped, s.bind == 0, not s.name.startswith("__aeabi_")))] for a, symbols in names.items()}

    def owner(self, address):
        """Start of the function that an address lies in."""
        i = bisect.bisect_right(self.starts, address) - 1
        return self.starts[i] if i >= 0 else address

    def name(self, address):
        start = self.owner(address)
        if start not in self.names:
            return f"{address:#x}"
        return self.names[start][0] + (f"+{address - start:#x}" if address != start else "")

    def ends_function(self, instruction):
        """Whether data or another function follows, after padding."""
        address = instruction.next
        while address is not None and address not in self.names and self.instructions[address].root == "nop":
            address = self.instructions[address].next
        return address is None or address in self.names

    def end(self, start):
        i = bisect.bisect_right(self.starts, start)
        return self.starts[i] if i < len(self.starts) else max(self.instructions) + 1


class Call:
    """A call site: depth of the stack there and the address called, None for a call through a register."""

    def __init__(self, site, depth, base, target, text):
        self.site, self.depth, self.base, self.target, self.text = site, depth, base, target, text


class Flow:
    """Result of a walk from one entry. Depths count from the stack pointer at the entry, or from `base` after a switch of stacks."""

    def __init__(self):
        self.calls, self.returns, self.deepest = {}, False, {}  # deepest: base -> (bytes, address)
        self.frames, self.visited = {}, set()


class State:
    __slots__ = ("depth", "base", "copies", "constants", "maybe")

    def __init__(self, depth=0, base=None, copies=None, constants=None, maybe=None):
        self.depth, self.base, self.copies, self.constants, self.maybe = depth, base, copies or {}, constants or {}, maybe

    def copy(self):
        return State(self.depth, self.base, dict(self.copies), dict(self.constants), self.maybe)


def immediate(text):
    found = re.fullmatch(r"#(-?(?:0x[0-9a-f]+|\d+))", text.strip())
    return int(found.group(1), 0) if found else None


class Walker:
    """Walks all paths from an entry. `noreturn(address)` is true for a called function that returns."""

    def __init__(self, code, noreturn):
        self.code, self.noreturn = code, noreturn

    def walk(self, entry):
        flow, states, tables = Flow(), {}, {}
        pending = [(entry, State(), None)]
        raised = {}
        while True:
            while pending:
                address, state, _ = pending.pop()
                seen = states.get(address)
                if seen is not None:
                    merged = self.merge(seen, state)
                    if merged is None:
                        continue
                    raised[address] = raised.get(address, 0) + 1
                    if merged.depth > seen.depth and raised[address] > 200:
                        raise Problem(f"{self.code.name(address)}: the stack grows in a loop")
                    state = merged
                states[address] = state
                instruction = self.code.instructions.get(address)
                if instruction is None:
                    raise Problem(f"{self.code.name(address)}: runs into data at {address:#x}")
                pending += self.step(instruction, state.copy(), flow, tables)
            # The cases of a jump table are reached at the depth that the table was read with.
            for start, state in tables.items():
                last = self.code.end(start)
                missing = [a for a, i in self.code.instructions.items() if start <= a < last and a not in states and i.root != "nop"]
                if missing:
                    pending.append((min(missing), state.copy(), None))
            if not pending:
                break
        flow.visited = set(states)
        for address, state in states.items():
            best = flow.deepest.get(state.base)
            if best is None or state.depth > best[0]:
                flow.deepest[state.base] = (state.depth, address)
            start = self.code.owner(address)
            if start in states and states[start].base == state.base:
                flow.frames[start] = max(flow.frames.get(start, 0), state.depth - states[start].depth)
        return flow

    @staticmethod
    def merge(old, new):
        """The state that covers both, None when the old one does already."""
        if new.base != old.base:
            raise Problem("two stacks meet")
        copies = {r: v for r, v in old.copies.items() if new.copies.get(r) == v}
        constants = {r: v for r, v in old.constants.items() if new.constants.get(r) == v}
        maybe = old.maybe if old.maybe == new.maybe else None
        depth = max(old.depth, new.depth)
        if depth == old.depth and copies == old.copies and constants == old.constants and maybe == old.maybe:
            return None
        return State(depth, old.base, copies, constants, maybe)

    def step(self, i, state, flow, tables):
        code, image = self.code, self.code.image
        depth_before = state.depth
        # A pop that happens only under a condition counts for the return or jump under the same condition, and for nothing else.
        if state.maybe is not None and state.maybe[0] == i.condition:
            state.depth = state.maybe[1]
        elif state.maybe is not None:
            state.maybe = None

        def following(changed):
            if i.next is None:
                raise Problem(f"{code.name(i.address)}: runs into data after {i}")
            if i.condition is not None:
                if changed.depth < depth_before:
                    changed.maybe, changed.depth = (i.condition, changed.depth), depth_before
                else:
                    changed.maybe = None
            return [(i.next, changed, None)]

        otherwise = [] if i.condition is None else following(State(depth_before, state.base, state.copies, state.constants))
        first = i.operands.split(",")[0].strip()
        rest = i.operands[len(first):].lstrip(", ")

        # Calls and jumps
        if i.root in ("bl", "blx"):
            register = first if i.target is None else None
            target = i.target
            if register is not None and register in state.constants:
                target = state.constants[register] & ~1
            flow.calls[i.address] = Call(i.address, state.depth, state.base, target, str(i))
            if target is not None and self.noreturn(target):
                return otherwise
            if i.condition is None and code.ends_function(i):
                return []  # nothing of this function follows the call: the called one cannot come back
            for r in ("r0", "r1", "r2", "r3", "ip", "lr"):
                state.copies.pop(r, None)
                state.constants.pop(r, None)
            return following(state)
        if i.root == "b" and i.target is not None:
            if i.target not in code.instructions:
                raise Problem(f"{code.name(i.address)}: jumps outside the code: {i}")
            jumped = State(state.depth, state.base, dict(state.copies), dict(state.constants))
            return [(i.target, jumped, None)] + otherwise
        if i.root in ("cbz", "cbnz"):
            return [(i.target, state.copy(), None)] + following(state)
        if i.root in ("tbb", "tbh"):
            tables[code.owner(i.address)] = state
            return []
        if i.root in ("bx", "mov", "movs") and (first == "pc" or i.root == "bx"):
            register = rest if first == "pc" else first
            if register == "lr":
                flow.returns = True
            elif register in state.constants:
                return [(state.constants[register] & ~1, state, None)] + otherwise
            else:
                flow.calls[i.address] = Call(i.address, state.depth, state.base, None, str(i))
                flow.returns = True
            return otherwise
        if i.root == "subs" and first == "pc":
            flow.returns = True
            return otherwise
        if i.root in ("ldr", "add") and first == "pc":
            if i.literal is not None and i.root == "ldr":
                return [((image.word(i.literal) or 0) & ~1, state, None)] + otherwise
            if "sp" in rest:
                flow.returns = True
            elif "pc" in rest or self.table_inside(i, rest, state):
                tables[code.owner(i.address)] = state
            else:
                flow.calls[i.address] = Call(i.address, state.depth, state.base, None, str(i))
                flow.returns = True
            return otherwise
        if i.root in ("udf", ".inst"):
            return []
        if i.root.startswith("rfe"):
            flow.returns = True
            return []

        # Pushes and pops
        if i.root in ("push", "vpush"):
            size, _ = registers(i.operands)
            state.depth += size
            return following(state)
        if i.root in ("stmdb", "stmfd", "vstmdb") and first == "sp!":
            state.depth += registers(rest)[0]
            return following(state)
        if i.root.startswith("srsdb"):
            state.depth += 8
            return following(state)
        if i.root in ("pop", "vpop") or (i.root in ("ldm", "ldmia", "ldmfd", "vldmia") and first == "sp!"):
            size, names = registers(i.operands if i.root in ("pop", "vpop") else rest)
            if "pc" in names:
                flow.returns = True
                return otherwise
            state.depth -= size
            for r in names:
                state.copies.pop(r, None)
                state.constants.pop(r, None)
            return following(state)
        if i.root in ("ldm", "ldmia", "ldmfd", "ldmib") and first == "sp" and not {"sp", "pc"} & set(registers(rest)[1]):
            for r in registers(rest)[1]:  # read beside the stack pointer, which stays
                state.copies.pop(r, None)
                state.constants.pop(r, None)
            return following(state)
        if (i.root.startswith(("ldm", "pop"))) and "pc" in registers(rest)[1]:
            flow.returns = True
            return otherwise
        moved = re.search(r"\[sp, #(-?\d+)\]!", i.operands)
        if moved:
            state.depth -= int(moved.group(1))
            return following(state)
        moved = re.search(r"\[sp\], #(-?\d+)", i.operands)
        if moved:
            state.depth -= int(moved.group(1))
            return following(state)

        # Arithmetic on the stack pointer and on copies of it
        root = i.root.rstrip("w") if i.root in ("addw", "subw") else i.root
        parts = [p.strip() for p in i.operands.split(",")]
        if first == "sp" and not WRITES_NOTHING.match(root):
            self.stack_pointer(i, root, parts, state)
            return following(state)
        if i.root == "msr" and first.lower() in ("msp", "psp"):
            raise Problem(f"{code.name(i.address)}: sets {first}")
        self.track(i, root, parts, state)
        return following(state)

    def table_inside(self, i, operand, state):
        """Whether 'ldr pc, [rT, rI, lsl #2]' reads a table that lies within the function itself."""
        base = re.match(r"\[(\w+),", operand)
        address = state.constants.get(base.group(1)) if base else None
        start = self.code.owner(i.address)
        return address is not None and start <= address < self.code.end(start)

    def stack_pointer(self, i, root, parts, state):
        where = f"{self.code.name(i.address)} at {i}"
        amount = immediate(parts[-1])
        if root in ("add", "sub", "adds", "subs"):
            sign = 1 if root.startswith("sub") else -1
            source = parts[1] if len(parts) == 3 else "sp"
            if amount is None and parts[-1] in state.constants and source == "sp":
                value = state.constants[parts[-1]]
                amount = value - (1 << 32) if value >> 31 else value
            if amount is None:
                raise Problem(f"{where}: an amount that depends on data")
            if source == "sp":
                state.depth += sign * amount
            elif source in state.copies:
                state.depth = state.copies[source] + sign * amount
            else:
                raise Problem(f"{where}: from a register that is no copy of sp")
        elif root in ("bic", "and") and amount is not None and parts[1] in ("sp", parts[-1]):
            state.depth += amount if root == "bic" else (~amount & 0xFFFFFFFF)
        elif root == "mov" and parts[1] in state.copies:
            state.depth = state.copies[parts[1]]
        elif root == "mov" and parts[1] in state.constants:
            state.depth, state.base = 0, state.constants[parts[1]]
            state.copies = {}
        elif root == "ldr" and i.literal is not None:
            state.depth, state.base = 0, self.code.image.word(i.literal)
            state.copies = {}
        else:
            raise Problem(f"{where}: what this does to the stack pointer is not known")

    def track(self, i, root, parts, state):
        """Registers that hold a copy of sp or a constant."""
        destination = parts[0]
        if WRITES_NOTHING.match(root) or not destination:
            return
        copy = constant = None
        amount = immediate(parts[-1])
        conditional = i.condition is not None
        if root == "mov" and len(parts) == 2:
            copy = state.depth if parts[1] == "sp" else state.copies.get(parts[1])
            constant = amount if amount is not None else state.constants.get(parts[1])
        elif root in ("movs", "movw") and amount is not None:
            constant = amount
        elif root == "mvn" and amount is not None:
            constant = ~amount
        elif root == "movt" and amount is not None and destination in state.constants:
            constant = (state.constants[destination] & 0xFFFF) | amount << 16
        elif root == "ldr" and i.literal is not None:
            constant = self.code.image.word(i.literal)
        elif i.adr is not None:
            constant = i.adr
        elif root in ("add", "adds", "sub", "subs") and amount is not None:
            source = parts[1] if len(parts) == 3 else destination
            change = amount if root.startswith("sub") else -amount
            at = state.depth if source == "sp" else state.copies.get(source)
            copy = None if at is None else at + change
            if source in state.constants:
                constant = state.constants[source] - change
        for written in registers(i.operands[i.operands.find("{"):])[1] if root.startswith("ldm") else [destination.rstrip("!")]:
            state.copies.pop(written, None)
            state.constants.pop(written, None)
        if root in ("ldrd", "smull", "umull", "umlal", "smlal", "vmov") and len(parts) > 1:
            state.copies.pop(parts[1], None)
            state.constants.pop(parts[1], None)
        if conditional:
            return
        if copy is not None:
            state.copies[destination] = copy
        if constant is not None:
            state.constants[destination] = constant & 0xFFFFFFFF
