/* The least a program on a CAN bus can do: every frame goes back as it came.
 *
 * usage: echo INTERFACE */
#include <linux/can.h>
#include <net/if.h>
#include <stdio.h>
#include <sys/socket.h>
#include <unistd.h>

int main(int argc, char** argv) {
  int bus = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  struct sockaddr_can address = {.can_family = AF_CAN};
  address.can_ifindex = (int)if_nametoindex(argc > 1 ? argv[1] : "vcan0");
  if (bind(bus, (struct sockaddr*)&address, sizeof address) < 0) {
    perror("echo");
    return 1;
  }
  puts("echo ready");
  fflush(stdout);
  struct can_frame frame;
  while (read(bus, &frame, sizeof frame) == sizeof frame) {
    if (write(bus, &frame, sizeof frame) != sizeof frame) return 1;
  }
  return 1;
}
