/* SPDX-License-Identifier: Apache-2.0 */
/* sim_host/c_api/tetap_replay.h from C11: replay_test LOG, the record of a rover. What fails is printed; the status is their number. Compiled and run
   by test/tools/replay_library_test.py. */
#include "sim_host/c_api/tetap_replay.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

static void check(bool right, const char* what, const char* said) {
  if (right) return;
  ++failures;
  fprintf(stderr, "%s; it said: '%s'\n", what, said);
}
#define CHECK(condition, replay) check(condition, #condition, tetap_replay_error(replay))

static bool says(const tetap_replay* replay, const char* words) { return strstr(tetap_replay_error(replay), words) != NULL; }

static char* text_of(const char* path, size_t* size) {
  FILE* file = fopen(path, "rb");
  if (file == NULL || fseek(file, 0, SEEK_END) != 0) exit(99);
  *size = (size_t)ftell(file);
  rewind(file);
  char* text = malloc(*size);
  if (text == NULL || fread(text, 1, *size, file) != *size) exit(99);
  fclose(file);
  return text;
}

static void refusals(void) {
  CHECK(tetap_replay_api() == TETAP_REPLAY_API, NULL);
  CHECK(strstr(tetap_replay_robots(), "rover") != NULL, NULL);
  CHECK(tetap_replay_open("tractor", NULL) == NULL && says(NULL, "no robot 'tractor'"), NULL);
  CHECK(tetap_replay_open(NULL, NULL) == NULL && says(NULL, "no robot"), NULL);
  CHECK(tetap_replay_open("rover", "gnss.gate_scale = -1") == NULL && says(NULL, "settings:1: gnss.gate_scale is -1"), NULL);
  CHECK(tetap_replay_open("rover", "\ngnss.gates = 1") == NULL && says(NULL, "settings:2: no parameter 'gnss.gates'"), NULL);
  tetap_replay_close(NULL);
  CHECK(tetap_replay_tick(NULL, 20000) == -1 && tetap_replay_push(NULL, NULL, 0) == -1 && tetap_replay_read(NULL, NULL, 0) == 0, NULL);
}

static void by_ticks(void) {
  tetap_replay* one = tetap_replay_open("rover", "# with another number\ngnss.gate_scale = 2.5");
  if (one == NULL) exit(98);
  CHECK(tetap_replay_error(NULL)[0] == '\0', NULL);
  CHECK(strstr(tetap_replay_parameters(one), "\"gnss.gate_scale\": 2.5") != NULL, one);

  tetap_frame frames[3] = {{.id = 0x306, .size = 8}, {.id = 0x123, .size = 8}, {.id = 0x306, .size = 9}};
  CHECK(tetap_replay_push(one, frames, 3) == -1 && says(one, "frame 2: id 774, size 9"), one);
  CHECK(tetap_replay_push(one, frames, 2) == 1 && says(one, ""), one);  /* 0x123 is no input */
  CHECK(tetap_replay_push(one, NULL, 1) == -1, one);
  CHECK(tetap_replay_tick(one, 9999) == -1 && says(one, "9999"), one);
  CHECK(tetap_replay_tick(one, 1000000) == 0, one);
  CHECK(tetap_replay_tick(one, 1000000) == -1 && says(one, "not later"), one);

  const size_t there = tetap_replay_read(one, NULL, 0);
  tetap_frame* got = calloc(there, sizeof *got);
  CHECK(there > 2 && got != NULL && tetap_replay_read(one, got, 2) == 2, one);
  CHECK(got[0].id == 0x320 && got[0].time_us == 1000000 && got[0].size == 8 && got[0].extended == 0, one);
  uint64_t time_us = 0;
  memcpy(&time_us, got[0].data, 6);  /* Est_Epoch's time, in a little-endian host */
  CHECK(time_us == 1000000, one);
  CHECK(tetap_replay_read(one, got + 2, there) == there - 2 && tetap_replay_read(one, got, there) == 0, one);
  CHECK(got[there - 1].id == 0x321 && got[there - 1].data[4] == 1 && got[there - 1].data[5] == 0, one);  /* one input was consumed */
  free(got);
  tetap_replay_close(one);
}

static void by_log(const char* log, size_t size) {
  tetap_replay* one = tetap_replay_open("rover", NULL);
  if (one == NULL) exit(98);
  tetap_replay_result record = {0}, inputs = {0};
  CHECK(tetap_replay_play(one, log, size, "a.log", TETAP_REPLAY_AUTOMATIC, &record) == 0, one);
  CHECK(record.recorded == 1 && record.compared == record.epochs && record.epochs > 1000 && record.different == 0, one);
  CHECK(record.frames_lost == 0 && tetap_replay_complaint(one)[0] == '\0', one);
  CHECK(tetap_replay_began_with(one)[0] == '\0' && tetap_replay_began_with(NULL)[0] == '\0', one);
  const size_t there = tetap_replay_read(one, NULL, 0);
  CHECK(there > 4 * record.epochs, one);
  CHECK(tetap_replay_play(one, log, size, NULL, TETAP_REPLAY_INPUTS, &inputs) == 0, one);
  CHECK(inputs.recorded == 0 && inputs.compared == 0 && inputs.frames_in == record.frames_in, one);
  CHECK(inputs.state_crc == record.state_crc && tetap_replay_read(one, NULL, 0) == there, one);

  CHECK(tetap_replay_play(one, "what\n", 5, "a.log", TETAP_REPLAY_AUTOMATIC, &inputs) == -1 && says(one, "a.log:1: "), one);
  CHECK(inputs.state_crc == record.state_crc, one);  /* no result */
  CHECK(tetap_replay_play(one, "", 0, NULL, TETAP_REPLAY_AUTOMATIC, NULL) == -1 && says(one, "log: no CAN data frame"), one);
  CHECK(tetap_replay_play(one, NULL, 0, NULL, TETAP_REPLAY_AUTOMATIC, NULL) == -1, one);
  CHECK(tetap_replay_play(one, log, size, NULL, 7, NULL) == -1 && says(one, "no mode 7"), one);
  tetap_replay_close(one);
}

int main(int count, char** values) {
  if (count != 2) return 99;
  _Static_assert(sizeof(tetap_frame) == 24 && sizeof(tetap_replay_result) == 48, "layouts of the interface");
  size_t size = 0;
  char* log = text_of(values[1], &size);
  refusals();
  by_ticks();
  by_log(log, size);
  free(log);
  return failures;
}
