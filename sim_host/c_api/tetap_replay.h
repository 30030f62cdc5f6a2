/* SPDX-License-Identifier: Apache-2.0 */
/* Replay of a robot's node in a program of yours: C11, no exception leaves it. The node is the one that is flashed.
   Input frames go in, a tick makes an epoch, its frames come out; or a whole log is played at once. A function that
   fails says why in tetap_replay_error(). */
#ifndef TETAP_REPLAY_H
#define TETAP_REPLAY_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this header. A library of the same number has all that is in it; it grows by functions at the end. */
#define TETAP_REPLAY_API 2

/* A node and the frames that it has sent. Two of them share nothing; one is for one thread at a time. */
typedef struct tetap_replay tetap_replay;

typedef struct tetap_frame {
  int64_t time_us;  /* of a frame that was read: the time of its epoch; of one that is pushed: not looked at */
  uint32_t id;      /* 11 bits, or 29 where extended */
  uint8_t size;     /* bytes of data, 0 to 8 */
  uint8_t extended; /* 1: an identifier of 29 bits */
  uint8_t reserved[2];
  uint8_t data[8];
} tetap_frame;

enum tetap_replay_mode {
  TETAP_REPLAY_AUTOMATIC = 0,  /* as recorded where a node speaks in the log, else its inputs */
  TETAP_REPLAY_INPUTS = 1,     /* the inputs alone, at the log's ticks or every 10 ms */
  TETAP_REPLAY_AS_RECORDED = 2 /* repeats the recorded run and compares every epoch with it */
};

typedef struct tetap_replay_result {
  uint64_t epochs;      /* that the node made */
  uint64_t compared;    /* of these, with an epoch of the record */
  uint64_t different;   /* of these, not equal to it to the last bit */
  uint64_t frames_in;   /* inputs that the node was given */
  uint64_t frames_lost; /* inputs and outputs; 0 unless something is wrong */
  uint32_t state_crc;   /* Est_StateCrc of the last epoch */
  uint32_t recorded;    /* 1: the log was repeated as a record */
} tetap_replay_result;

/* TETAP_REPLAY_API of the library. */
uint32_t tetap_replay_api(void);

/* Names of all robots, with a space between each. */
const char* tetap_replay_robots(void);

/* A node of that robot with its own parameters, and with `settings` over them: lines `path = value`, # begins a
   comment; NULL: none. NULL where it fails: no such robot, not built, a setting that is out of its limits or breaks a
   rule. */
tetap_replay* tetap_replay_open(const char* robot, const char* settings);

/* Frees it; NULL is taken. Texts that it gave end with it. */
void tetap_replay_close(tetap_replay* replay);

/* Why the last call on this replay failed, one sentence; NULL: why the last open of this thread did. Empty: it did not.
 */
const char* tetap_replay_error(const tetap_replay* replay);

/* Path and value of every parameter of the node, as a JSON object. */
const char* tetap_replay_parameters(tetap_replay* replay);

/* Input frames for the next tick. Frames that are no inputs of the node are left out, In_Sync among them. Their number
   without these; -1: failed, and none is taken. */
int tetap_replay_push(tetap_replay* replay, const tetap_frame* frames, size_t count);

/* The node consumes what was pushed and makes the epoch of this time [us]. The first tick, at 10 ms or later, is one
   period behind its power-on; each is later than the one before. 0; -1: failed. */
int tetap_replay_tick(tetap_replay* replay, int64_t time_us);

/* Plays the text of a log (candump -L and its kin) to a node that has just been switched on, not to that of push and
   tick. `name` is what messages call it; NULL: "log". `mode` is one of tetap_replay_mode. Frames that were not read are
   dropped before. 0; -1: failed, and no result. */
int tetap_replay_play(tetap_replay* replay, const char* log, size_t size, const char* name, int mode,
                      tetap_replay_result* result);

/* What is wrong with the last play that ended: lost frames, epochs that differ, a hole in the record. Empty: nothing.
 */
const char* tetap_replay_complaint(const tetap_replay* replay);

/* Takes up to `room` frames of the node, oldest first; their number. NULL for `frames`: how many there are. */
size_t tetap_replay_read(tetap_replay* replay, tetap_frame* frames, size_t room);

/* Since API 2. With which parameters the node of the last log that was played began, where they are not its robot's
   own: `PATH=VALUE` with spaces between, as its board kept them or the bus had set them. The node of the play takes
   them from the log; `settings` of the open stay. Empty: as its robot is built. */
const char* tetap_replay_began_with(const tetap_replay* replay);

#ifdef __cplusplus
}
#endif

#endif
