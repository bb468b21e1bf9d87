/* lk_shafts.h: messages of lk-emu's shaft port (lk-emu --shafts), which connects the drives to the
 * joints of a simulator. docs/guides/your-simulator.md explains the protocol. MIT licence.
 *
 * Needs C99 or later, or C++, and only the C library. The functions read and write the bytes of
 * one message. They keep no state; the caller opens the socket, receives and sends.
 *
 * A message is a head of 32 bytes and one record for each offered joint. All numbers are
 * little-endian. The offset of each number is a multiple of its size.
 *
 *   lk-emu -> simulator   OFFER     once, when the simulator has connected
 *   simulator -> lk-emu   ACCEPT    which joints the simulator takes, and who owns the time
 *   simulator -> lk-emu   STATES    of the joints at the beginning of a step
 *   lk-emu -> simulator   TORQUES   of the drives in this step; the next STATES follow
 *   lk-emu -> simulator   END       lk-emu disconnects; the reason as text replaces the records */
#ifndef LK_SHAFTS_H
#define LK_SHAFTS_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define LK_SHAFTS_VERSION 1
#define LK_SHAFTS_HEAD_BYTES 32
#define LK_SHAFTS_NAME_BYTES 64

/* Kinds of messages. */
enum { LK_SHAFTS_OFFER = 1, LK_SHAFTS_ACCEPT, LK_SHAFTS_STATES, LK_SHAFTS_TORQUES, LK_SHAFTS_END };

/* lk_shafts_head.what of ACCEPT: who owns the time. */
enum {
  LK_SHAFTS_TIME_IS_SIMULATORS = 1, /* lk-emu does one step for each STATES, then waits */
  LK_SHAFTS_TIME_IS_DRIVES = 2      /* lk-emu keeps its clock and does not wait for late STATES */
};

/* lk_shafts_accept.owner: which side computes the motion of a joint. */
enum {
  LK_SHAFTS_NOT_COUPLED = 0, /* not taken: the drive keeps the load of its robot file */
  LK_SHAFTS_SIMULATOR = 1,   /* simulator: applies the torque of TORQUES, adds the armature */
  LK_SHAFTS_DRIVE = 2        /* drive: gets inertia and torque of its load from STATES */
};

/* lk_shafts_accept.flags */
#define LK_SHAFTS_TORQUE_UNTOLD 1u /* owner SIMULATOR: lk-emu ignores torque_Nm of STATES and
                                      estimates it from the change of speed */

struct lk_shafts_head {
  uint32_t kind;
  uint32_t bytes;  /* length of the message, with this head */
  uint32_t joints; /* number of records; END: 0 */
  uint32_t what;   /* ACCEPT: owner of the time; TORQUES: number of steps averaged;
                      END: bytes of the text; others: 0 */
  uint64_t number; /* OFFER, ACCEPT: length of a step in ns (ACCEPT 0: as offered); TORQUES: steps
                      done so far; STATES: number of the last TORQUES, at first 0 */
};

struct lk_shafts_offer {
  char name[LK_SHAFTS_NAME_BYTES]; /* "vcan0:1": bus and ID; zero-terminated */
  double armature_kg_m2;           /* to be added to the joint, in the first step */
  double angle_rad;                /* present angle of the output shaft */
};

struct lk_shafts_accept {
  uint32_t owner;
  uint32_t flags;
};

struct lk_shafts_state { /* owner DRIVE: lk-emu ignores angle and speed */
  double angle_rad;
  double speed_rad_s;
  double inertia_kg_m2; /* SIMULATOR: inertia that the shaft feels, with the armature; 0: unknown.
                           DRIVE: inertia of the load, without the drive's own; 0 or more */
  double torque_Nm;     /* sum of the torques on this inertia, without the drive's */
};

struct lk_shafts_torque {
  double torque_Nm;         /* of the drive on the joint; mean of the steps averaged */
  double torque_slope_Nm_s; /* about the middle of the last step; optional to use */
  double armature_kg_m2;    /* inertia of the drive, to be added to the joint's own */
  double angle_rad;         /* of the output shaft, at the end of the step */
  double speed_rad_s;
};

/* Bytes of one record; 0 for END, which has none, and for an unknown kind. */
static inline size_t lk_shafts_record_bytes(uint32_t kind) {
  switch (kind) {
    case LK_SHAFTS_OFFER: return LK_SHAFTS_NAME_BYTES + 16;
    case LK_SHAFTS_ACCEPT: return 8;
    case LK_SHAFTS_STATES: return 32;
    case LK_SHAFTS_TORQUES: return 40;
    default: return 0;
  }
}
/* Bytes of a message, with its head. Not for END, whose length depends on its text. */
static inline size_t lk_shafts_bytes(uint32_t kind, uint32_t joints) {
  return LK_SHAFTS_HEAD_BYTES + lk_shafts_record_bytes(kind) * joints;
}
/* Offset of the record of joint number `joint`, from 0, in a message. */
static inline size_t lk_shafts_at(uint32_t kind, uint32_t joint) {
  return lk_shafts_bytes(kind, joint);
}

static inline void lk_shafts_put_u32(unsigned char* to, uint32_t value) {
  int n;
  for (n = 0; n < 4; ++n) to[n] = (value >> (8 * n)) & 0xFFu;
}
static inline void lk_shafts_put_u64(unsigned char* to, uint64_t value) {
  int n;
  for (n = 0; n < 8; ++n) to[n] = (value >> (8 * n)) & 0xFFu;
}
static inline void lk_shafts_put_f64(unsigned char* to, double value) {
  uint64_t bits;
  memcpy(&bits, &value, 8);
  lk_shafts_put_u64(to, bits);
}
static inline uint32_t lk_shafts_get_u32(const unsigned char* from) {
  uint32_t value = 0;
  int n;
  for (n = 3; n >= 0; --n) value = (value << 8) | from[n];
  return value;
}
static inline uint64_t lk_shafts_get_u64(const unsigned char* from) {
  uint64_t value = 0;
  int n;
  for (n = 7; n >= 0; --n) value = (value << 8) | from[n];
  return value;
}
static inline double lk_shafts_get_f64(const unsigned char* from) {
  const uint64_t bits = lk_shafts_get_u64(from);
  double value;
  memcpy(&value, &bits, 8);
  return value;
}

static inline void lk_shafts_put_head(unsigned char* to, const struct lk_shafts_head* head) {
  memcpy(to, "LKSH", 4);
  lk_shafts_put_u32(to + 4, LK_SHAFTS_VERSION);
  lk_shafts_put_u32(to + 8, head->kind);
  lk_shafts_put_u32(to + 12, head->bytes);
  lk_shafts_put_u32(to + 16, head->joints);
  lk_shafts_put_u32(to + 20, head->what);
  lk_shafts_put_u64(to + 24, head->number);
}
/* Reads LK_SHAFTS_HEAD_BYTES bytes. Returns NULL if they are a head of this version, and its length
 * fits its kind; else the error. The caller must compare `joints` with the number of offers. */
static inline const char* lk_shafts_get_head(const unsigned char* from, struct lk_shafts_head* head) {
  uint64_t bytes;
  if (memcmp(from, "LKSH", 4) != 0) return "does not begin with LKSH";
  if (lk_shafts_get_u32(from + 4) != LK_SHAFTS_VERSION) return "is of another version";
  head->kind = lk_shafts_get_u32(from + 8);
  head->bytes = lk_shafts_get_u32(from + 12);
  head->joints = lk_shafts_get_u32(from + 16);
  head->what = lk_shafts_get_u32(from + 20);
  head->number = lk_shafts_get_u64(from + 24);
  if (head->kind < LK_SHAFTS_OFFER || head->kind > LK_SHAFTS_END) return "is of no known kind";
  bytes = lk_shafts_record_bytes(head->kind);
  bytes *= head->joints;
  if (head->kind == LK_SHAFTS_END) {
    bytes = head->what;
    bytes += (8 - bytes % 8) % 8;
  }
  return LK_SHAFTS_HEAD_BYTES + bytes == head->bytes ? NULL : "has another length than its records";
}

static inline void lk_shafts_put_offer(unsigned char* to, const struct lk_shafts_offer* offer) {
  memcpy(to, offer->name, LK_SHAFTS_NAME_BYTES);
  lk_shafts_put_f64(to + 64, offer->armature_kg_m2);
  lk_shafts_put_f64(to + 72, offer->angle_rad);
}
static inline void lk_shafts_get_offer(const unsigned char* from, struct lk_shafts_offer* offer) {
  memcpy(offer->name, from, LK_SHAFTS_NAME_BYTES);
  offer->name[LK_SHAFTS_NAME_BYTES - 1] = 0;
  offer->armature_kg_m2 = lk_shafts_get_f64(from + 64);
  offer->angle_rad = lk_shafts_get_f64(from + 72);
}
static inline void lk_shafts_put_accept(unsigned char* to, const struct lk_shafts_accept* accept) {
  lk_shafts_put_u32(to, accept->owner);
  lk_shafts_put_u32(to + 4, accept->flags);
}
static inline void lk_shafts_get_accept(const unsigned char* from, struct lk_shafts_accept* accept) {
  accept->owner = lk_shafts_get_u32(from);
  accept->flags = lk_shafts_get_u32(from + 4);
}
static inline void lk_shafts_put_state(unsigned char* to, const struct lk_shafts_state* state) {
  lk_shafts_put_f64(to, state->angle_rad);
  lk_shafts_put_f64(to + 8, state->speed_rad_s);
  lk_shafts_put_f64(to + 16, state->inertia_kg_m2);
  lk_shafts_put_f64(to + 24, state->torque_Nm);
}
static inline void lk_shafts_get_state(const unsigned char* from, struct lk_shafts_state* state) {
  state->angle_rad = lk_shafts_get_f64(from);
  state->speed_rad_s = lk_shafts_get_f64(from + 8);
  state->inertia_kg_m2 = lk_shafts_get_f64(from + 16);
  state->torque_Nm = lk_shafts_get_f64(from + 24);
}
static inline void lk_shafts_put_torque(unsigned char* to, const struct lk_shafts_torque* torque) {
  lk_shafts_put_f64(to, torque->torque_Nm);
  lk_shafts_put_f64(to + 8, torque->torque_slope_Nm_s);
  lk_shafts_put_f64(to + 16, torque->armature_kg_m2);
  lk_shafts_put_f64(to + 24, torque->angle_rad);
  lk_shafts_put_f64(to + 32, torque->speed_rad_s);
}
static inline void lk_shafts_get_torque(const unsigned char* from, struct lk_shafts_torque* torque) {
  torque->torque_Nm = lk_shafts_get_f64(from);
  torque->torque_slope_Nm_s = lk_shafts_get_f64(from + 8);
  torque->armature_kg_m2 = lk_shafts_get_f64(from + 16);
  torque->angle_rad = lk_shafts_get_f64(from + 24);
  torque->speed_rad_s = lk_shafts_get_f64(from + 32);
}

#endif
