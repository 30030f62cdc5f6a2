# tetap. This file only calls presets and tools; `make` prints what there is.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help

ROBOT ?= rover
BOARD ?= linux
SEED  ?= 1
FAULT ?=
REALTIME ?=
# An image, and time as it passes, need a bus.
BUS   ?= $(if $(REALTIME)$(filter-out linux,$(BOARD)),vcan,memory)
LOG   ?=
PROBE ?=
DRY_RUN ?=
ENGINE ?=
NODES ?=
TRUTH ?=
PARAMS ?=
SET   ?=
STEPS ?=
CELLS ?=
export ROBOT BOARD PROBE DRY_RUN BUS SEED FAULT REALTIME LOG TRUTH PARAMS SET

# A misspelt name would be taken for the default without a word: FALUT=gnss_jump would run another world than its user thinks.
settings := ROBOT BOARD PROBE DRY_RUN BUS SEED FAULT REALTIME LOG TRUTH OUT WORLD PLAY REPORT PARAMS SET STEPS CELLS ENGINE NODES TETAP_DATA
given := $(foreach name,$(.VARIABLES),$(if $(findstring command line,$(origin $(name))),$(name)))
unknown := $(filter-out $(settings) TETAP_% WITH_VCAN_% CMAKE_% CTEST_% CCACHE_% TMPDIR,$(given))
ifneq ($(unknown),)
$(error no setting $(unknown); there are: $(settings))
endif

# Refused here, before anything is built.
ifneq ($(filter replay doctor export,$(MAKECMDGOALS)),)
ifneq ($(and $(LOG),$(wildcard $(LOG)/.)),)
$(error LOG=$(LOG) is a folder, not a log)
endif
endif

# A run that was played in the page names its robot.
ifneq ($(and $(FAULT),$(wildcard $(FAULT))),)
override ROBOT := $(shell sed -n 's/^robot *= *\([^ \#]*\).*/\1/p' $(FAULT))
endif
comma := ,
robots := $(shell tools/run/list_robots)
# A robot of simulation alone is another one with other parameters.
module := $(if $(filter $(ROBOT),$(robots)),$(ROBOT),$(patsubst %_matched,%,$(filter rover_matched rover_landmarks_matched,$(ROBOT))))
ifneq ($(filter sim replay doctor programs firmware board flash laws page tune eds,$(MAKECMDGOALS)),)
ifeq ($(module),)
$(error no robot '$(ROBOT)'; there are: $(robots) rover_landmarks_matched rover_matched)
endif
endif
engine := $(if $(ENGINE),--engine $(ENGINE)) $(if $(NODES),--nodes $(NODES))
node := $(if $(filter memory,$(BUS)),,$(comma)tetap-node)
page_suffix := $(if $(filter file,$(origin ROBOT)),,.$(module))
page_file := out/page/tetap$(page_suffix).html
page_variant := $(if $(page_suffix),TETAP_VARIANT=$(module) TETAP_SETTINGS=-DTETAP_PAGE_ROBOTS=$(module))

.PHONY: help sim board test quick proof replay record doctor export eds tune release firmware flash size heap stack count bits hashes soak matrix swarm mutants laws constants bench costs check docs dbc page page-test setup programs arm

help: ## this list
	@echo "tetap: state estimation on the robot's own microcontroller"; echo
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | while IFS=$$'\t' read -r name text; do printf '  make %-9s %s\n' "$$name" "$$text"; done
	@echo; echo "  ROBOT=$(ROBOT) BOARD=$(BOARD) BUS=$(BUS) SEED=$(SEED) FAULT= REALTIME= LOG= TRUTH="
	@echo "  robots: $$(tools/run/list_robots) (a config/NAME.hpp of your own is one, too)"
	@echo "  and in simulation alone, with parameters that equal the noise of the world: rover_landmarks_matched rover_matched"

sim: setup ## a simulated world: table, report, pictures in out/sim (SEED= FAULT= OUT=DIR; over vcan0: BUS=vcan REALTIME=1 BOARD=zynqmp_r5)
	@tools/run/build_preset host:tetap-world,tetap-doctor,robot_$(module)$(node)
	@tools/run/simulate_world

board: setup ## a flash image on an emulated board in the simulated world, repeated on the host: report in out/board (BOARD=ark_cannode, nucleo_g474re ROBOT= SEED= FAULT= BUS=vcan)
	@tools/run/build_preset host:tetap-board,tetap-world,tetap-play,robot_$(module)
	@BUS=$(if $(filter file,$(origin BUS)),memory,$(BUS)) tools/run/emulate_board

test: setup ## every check on prefixes and samples, what is unchanged left out (STEPS="unit_tests check", TETAP_FRESH=1)
	@tools/proof/run_checks test $(STEPS)

quick: setup ## unit tests only
	@tools/run/build_preset clang
	@ctest --preset quick

proof: setup ## the same on whole lengths, every float, long runs; goes on where it was interrupted (STEPS=)
	@tools/proof/run_checks proof $(STEPS)

replay: setup ## a recorded log: LOG=run.log [TRUTH=run.truth.csv] ROBOT=NAME (over vcan0: BUS=vcan [BOARD=zynqmp_r5])
	@tools/run/build_preset host:tetap-play,tetap-doctor,robot_$(module)$(node)
	@tools/run/replay_log

record: setup ## everything on vcan0 until ^C, in out/record: raw.log can be repeated, also of a node that runs already
	@tools/run/build_preset host:tetap-record
	@build/host/sim_host/tetap-record --snapshot

doctor: setup ## the likeliest mistake in a log, by its devices alone: LOG=run.log [ROBOT=NAME], in out/doctor.json
	@tools/run/build_preset host:tetap-doctor$(if $(filter file,$(origin ROBOT)),,$(comma)robot_$(module))
	@tools/run/diagnose_log $(if $(filter file,$(origin ROBOT)),,$(ROBOT))

export: setup ## a log as MCAP with messages of ROS 2: LOG=run.log [OUT=FILE.mcap]
	@tools/can/export_log $(or $(LOG),$(error LOG=FILE is missing)) $(or $(OUT),out/export.mcap)

tune: setup ## noise rows by the likelihood of recorded drives: LOG="a.log b.log" ROBOT=NAME [TRUTH="a.truth.csv b.truth.csv"], in out/tune
	@test -n "$(LOG)" || { echo "make tune: name a log: LOG=run.log ROBOT=$(ROBOT)" >&2; exit 2; }
	@tools/run/build_preset host:tetap-params,tetap-play,robot_$(module)
	@TETAP_VARIANT=views TETAP_SETTINGS=-DTETAP_VIEWS=ON tools/run/build_preset host:tetap-innovations,robot_$(module)
	@tools/calibrate/tune_robot $(LOG) --robot $(ROBOT) $(addprefix --truth ,$(TRUTH)) $(if $(PARAMS),--params $(PARAMS)) $(addprefix --set ,$(SET)) --out $(or $(OUT),out/tune) $(engine)

eds: setup ## the CANopen data sheet of a robot that takes parameters from its bus: ROBOT=mrclam, in out/ROBOT.eds
	@tools/run/build_preset host:tetap-params,robot_$(module)
	@mkdir -p out && build/host/sim_host/tetap-params --robot $(ROBOT) --eds > out/$(ROBOT).eds && echo out/$(ROBOT).eds

release: setup ## images, packages, DBC, data sheets, bill of materials and sums in out/release, of a committed tree
	@tools/run/make_release

firmware: setup ## the flash image: BOARD=zynqmp_r5 ROBOT=rover, with its size table, no heap and stack proved
	@tools/run/build_firmware

flash: setup ## writes the image onto a board: BOARD=ark_cannode ROBOT=rover PROBE=stlink, openocd or dfu (DRY_RUN=1 only prints)
	@tools/run/flash_board

size: arm ## flash and RAM per section of every image against the budgets
	@tools/proof/check_images size

heap: arm ## no allocator in any linked image
	@tools/proof/check_images heap

stack: arm programs ## worst-case stack from the call graph, against the painted high-water mark
	@tools/proof/check_images stack

count: setup ## instructions per workload and per tick on the emulated cores, against the budgets
	@tools/run/build_preset r5:counts m7:counts m4f:counts
	@tools/proof/count_instructions --all

bench: setup ## time beside OpenCV, Orocos BFL, Eigen and Ceres on this machine, in out/bench.json (their packages are installed for it)
	@tools/proof/run_benchmarks

costs: setup ## each filter: accuracy on one scenario, RAM, flash, stack, instructions on three cores, in out/costs.json
	@tools/proof/measure_costs

bits: setup ## the same bits from every compiler, option and core: 2^24 values, 100000 steps (some 8 minutes)
	@tools/proof/compare_bits --whole

soak: setup ## the node on a hostile bus: 10^8 frames and 24 h of robot time at least, in out/soak.json; goes on where it was interrupted
	@tools/run/build_preset host:soak
	@tools/proof/run_soak

constants: setup ## numbers in the code and parameters that the inertial estimator reaches, in out/constants.json
	@tools/proof/count_constants

hashes: setup programs ## a hash of each estimate over simulated and recorded runs, in out/hashes.json
	@tools/proof/hash_estimates

matrix: setup ## faults of every sensor in every situation against what the node promises, in out/matrix.json (CELLS=1000); goes on where it was
	@tools/run/build_preset host:tetap-matrix,robots
	@tools/proof/run_matrix $(if $(CELLS),--cells $(CELLS)) $(engine)

swarm: setup programs ## faults drawn anew for each seed, and what is left a minute after all of them, in out/swarm.json (CELLS=100 seeds)
	@tools/proof/run_swarm $(if $(CELLS),--seeds $(CELLS)) $(engine)

mutants: setup ## constants of the inertial estimator doubled and halved: which no test notices, in out/mutants.json (CELLS=60: a sample); goes on where it was
	@tools/proof/run_mutants $(if $(CELLS),--constants $(CELLS)) $(engine)

laws: setup programs ## laws that need no truth (other stamps, order, time, place, mirror image) on LOG= of ROBOT=; figures in out/laws
	@test -n "$(LOG)" || { echo "make laws: name a log: LOG=file ROBOT=$(ROBOT)" >&2; exit 2; }
	@tools/proof/check_laws $(LOG) --robot $(ROBOT)

check: setup ## format, tidy, layers, DBC fresh
	@tools/proof/run_checks test check

docs: setup programs ## the generated pages of docs/
	@tools/report/write_docs --figures

dbc: setup ## docs/reference/messages.md from config/tetap.dbc; the C++ messages are made in each build folder
	@tools/can/generate_messages config/tetap.dbc --table docs/reference/messages.md

page: setup ## the player as one file for a browser, with all robots: out/page/tetap.html (ROBOT=NAME: with this one alone, tetap.NAME.html)
	@$(page_variant) tools/run/build_preset page:page_module
	@sim_host/page/pack build/page$(page_suffix)/sim_host/page/tetap.wasm $(page_file)

page-test: setup page ## the page in a headless browser against the host's programs, pictures in out/page (its browser is installed for it)
	@TETAP_PAGE=$(page_file) sim_host/page/test/run

setup:
	@tools/run/install_packages

programs: setup ## all host programs with all robots (ROBOT=NAME: with this one alone)
	@tools/run/build_preset host:programs,$(if $(filter file,$(origin ROBOT)),robots,robot_$(module))

arm: setup
	@tools/run/build_preset r5 m7 m4f
