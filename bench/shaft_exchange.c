/* Two ends of the shaft port, for bench/shafts.
 *
 * usage: shaft_exchange echo PATH           a server that computes nothing: torques of 0
 *        shaft_exchange ask PATH STEPS      a simulator of free inertias; prints the median and the
 *                                           mean of an exchange, in us */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "emulator/io/shafts/lk_shafts.h"

enum { JOINTS = 12, MOST = LK_SHAFTS_HEAD_BYTES + JOINTS * 80 };

static void fail(const char* what) {
  perror(what);
  exit(1);
}

static double now_us(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

static int by_value(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

static void read_all(int fd, unsigned char* to, size_t size) {
  while (size > 0) {
    const ssize_t got = read(fd, to, size);
    if (got <= 0) exit(0); /* the other end has gone */
    to += got;
    size -= (size_t)got;
  }
}

static void next(int fd, unsigned char* bytes, struct lk_shafts_head* head) {
  read_all(fd, bytes, LK_SHAFTS_HEAD_BYTES);
  if (lk_shafts_get_head(bytes, head) != NULL || head->bytes > MOST) exit(1);
  read_all(fd, bytes + LK_SHAFTS_HEAD_BYTES, head->bytes - LK_SHAFTS_HEAD_BYTES);
}

static void begin(unsigned char* bytes, uint32_t kind, uint32_t what, uint64_t number) {
  struct lk_shafts_head head = {kind, (uint32_t)lk_shafts_bytes(kind, JOINTS), JOINTS, what, number};
  memset(bytes, 0, MOST);
  lk_shafts_put_head(bytes, &head);
}

static void finish(int fd, const unsigned char* bytes, uint32_t kind) {
  const size_t size = lk_shafts_bytes(kind, JOINTS);
  if (write(fd, bytes, size) != (ssize_t)size) fail("write");
}

static void echo(int fd) {
  unsigned char in[MOST], out[MOST];
  struct lk_shafts_head head;
  uint64_t number = 0;
  begin(out, LK_SHAFTS_OFFER, 0, 1000000);
  finish(fd, out, LK_SHAFTS_OFFER);
  next(fd, in, &head);
  for (;;) {
    next(fd, in, &head);
    begin(out, LK_SHAFTS_TORQUES, 1, ++number);
    finish(fd, out, LK_SHAFTS_TORQUES);
  }
}

static void ask(int fd, int steps) {
  unsigned char in[MOST], out[MOST];
  struct lk_shafts_head head;
  struct lk_shafts_state joints[JOINTS];
  double *took = malloc(sizeof(double) * (size_t)steps), sum = 0;
  uint64_t number = 0;
  const double h = 1e-3, J = 0.02;
  int k;
  uint32_t n;
  memset(joints, 0, sizeof joints);
  next(fd, in, &head);
  if (head.kind != LK_SHAFTS_OFFER || head.joints != JOINTS) exit(1);
  for (n = 0; n < JOINTS; ++n) {
    struct lk_shafts_offer offer;
    lk_shafts_get_offer(in + lk_shafts_at(LK_SHAFTS_OFFER, n), &offer);
    joints[n].inertia_kg_m2 = J + offer.armature_kg_m2;
  }
  begin(out, LK_SHAFTS_ACCEPT, LK_SHAFTS_TIME_IS_SIMULATORS, 1000000);
  for (n = 0; n < JOINTS; ++n) {
    const struct lk_shafts_accept terms = {LK_SHAFTS_SIMULATOR, 0};
    lk_shafts_put_accept(out + lk_shafts_at(LK_SHAFTS_ACCEPT, n), &terms);
  }
  finish(fd, out, LK_SHAFTS_ACCEPT);
  for (k = 0; k < steps; ++k) {
    const double start = now_us();
    begin(out, LK_SHAFTS_STATES, 0, number);
    for (n = 0; n < JOINTS; ++n) lk_shafts_put_state(out + lk_shafts_at(LK_SHAFTS_STATES, n), &joints[n]);
    finish(fd, out, LK_SHAFTS_STATES);
    next(fd, in, &head);
    if (head.kind != LK_SHAFTS_TORQUES) exit(1);
    number = head.number;
    for (n = 0; n < JOINTS; ++n) {
      struct lk_shafts_torque torque;
      lk_shafts_get_torque(in + lk_shafts_at(LK_SHAFTS_TORQUES, n), &torque);
      joints[n].angle_rad += h * joints[n].speed_rad_s;
      joints[n].speed_rad_s += h * torque.torque_Nm / (J + torque.armature_kg_m2);
    }
    took[k] = now_us() - start;
    sum += took[k];
  }
  qsort(took, (size_t)steps, sizeof(double), by_value);
  printf("%.2f %.2f\n", took[steps / 2], sum / steps);
  free(took);
}

int main(int argc, char** argv) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
  if (argc < 3 || fd < 0) return 2;
  strncpy(address.sun_path, argv[2], sizeof address.sun_path - 1);
  if (strcmp(argv[1], "ask") == 0) {
    if (connect(fd, (struct sockaddr*)&address, sizeof address) != 0) fail(argv[2]);
    ask(fd, argc > 3 ? atoi(argv[3]) : 20000);
    return 0;
  }
  if (bind(fd, (struct sockaddr*)&address, sizeof address) != 0 || listen(fd, 1) != 0) fail(argv[2]);
  puts("echo ready");
  fflush(stdout);
  echo(accept(fd, NULL, NULL));
  return 0;
}
