# tetap. This file only calls presets and tools; `make` prints what there is.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help

ROBOT ?= rover
BOARD ?= linux
BUS   ?= vcan
SEED  ?= 1
FAULT ?=
REALTIME ?=
LOG   ?=
TRUTH ?=
export ROBOT BOARD BUS SEED FAULT REALTIME LOG TRUTH

# A misspelt name would be taken for the default without a word: FALUT=gnss_jump would run another world than its user thinks.
settings := ROBOT BOARD BUS SEED FAULT REALTIME LOG TRUTH OUT WORLD PLAY REPORT TETAP_DATA
given := $(foreach name,$(.VARIABLES),$(if $(findstring command line,$(origin $(name))),$(name)))
unknown := $(filter-out $(settings) TETAP_% WITH_VCAN_% CMAKE_% CTEST_% CCACHE_% TMPDIR,$(given))
ifneq ($(unknown),)
$(error no setting $(unknown); there are: $(settings))
endif

.PHONY: help sim test quick proof replay firmware size heap stack count bits hashes check dbc setup host programs arm

help: ## this list
	@echo "tetap: state estimation on the robot's own microcontroller"; echo
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | while IFS=$$'\t' read -r name text; do printf '  make %-9s %s\n' "$$name" "$$text"; done
	@echo; echo "  ROBOT=$(ROBOT) BOARD=$(BOARD) BUS=$(BUS) SEED=$(SEED) FAULT= REALTIME= LOG= TRUTH="
	@echo "  robots: $$(tools/robots) (a config/NAME.hpp of your own is one, too)"
	@echo "  and in simulation alone, told all of the world's noise: rover_landmarks_matched rover_matched"

sim: setup programs ## the simulated world over vcan0: table, report, pictures in out/sim (SEED= FAULT= REALTIME=1 BOARD=zynqmp_r5 BUS=memory OUT=DIR)
	@tools/sim

test: setup ## every proof on short prefixes, with a table of where the time went
	@tools/prove short

quick: setup host ## host unit tests only
	@ctest --preset quick

proof: setup ## the whole lengths: exhaustive functions, full logs, long runs
	@tools/prove whole

replay: setup programs ## a recorded log over vcan0: LOG=run.log [TRUTH=run.truth.csv] ROBOT=NAME [BOARD=] [BUS=memory]
	@tools/replay

firmware: setup ## the flash image: BOARD=zynqmp_r5 ROBOT=rover, with its size table, no heap and stack proved
	@tools/firmware

size: arm ## flash and RAM per section of every image against the budgets
	@tools/images size

heap: arm ## no allocator in any linked image
	@tools/images heap

stack: arm host ## worst-case stack from the call graph, against the painted high-water mark
	@tools/images stack

count: arm ## instructions per workload and per tick on the emulated cores, against the budgets
	@tools/count --all

bits: setup ## the same bits from every compiler, option and core: 2^24 values, 100000 steps (some 8 minutes)
	@tools/bits --whole

hashes: setup programs ## a hash of each estimate over simulated and recorded runs, in out/hashes.json
	@tools/hashes

check: setup host ## format, tidy, layers, DBC fresh
	@tools/check

dbc: setup ## config/messages.hpp and config/messages.md from config/tetap.dbc
	@tools/dbc config/tetap.dbc --header config/messages.hpp --table config/messages.md

setup:
	@tools/setup

host:
	@tools/build host

programs: setup
	@tools/build host:tetap-node,tetap-play,tetap-world,tetap-record

arm: setup
	@tools/build r5 m7 m4f
