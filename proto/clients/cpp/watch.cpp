// watch ENDPOINT STREAM [COUNT [OWN.key SERVER.pub]]: prints where the stream's joints are.
#include <cstdio>
#include <cstdlib>

#include "proto/clients/cpp/posed_client.hpp"

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4 && argc != 6) {
    std::fputs("usage: watch ENDPOINT STREAM [COUNT [OWN.key SERVER.pub]]\n", stderr);
    return 2;
  }
  try {
    posed_client::Keys keys;
    if (argc == 6) keys = {argv[4], argv[5]};
    posed_client::Subscriber subscriber(argv[1], argv[2], keys);
    const long count = argc > 3 ? std::strtol(argv[3], nullptr, 10) : 0;
    for (long shown = 0; count == 0 || shown < count; ++shown) {
      const auto pose = subscriber.next(std::chrono::seconds(10));
      if (!pose) throw std::runtime_error("nothing came for 10 s; is the daemon running?");
      const posed_client::World world = posed_client::world_of(*pose);
      std::printf("%s %llu\n", pose->frame.stream().c_str(),
                  static_cast<unsigned long long>(pose->frame.sequence()));
      for (int j = 0; j < pose->skeleton->joint_name_size(); ++j) {
        const auto& at = world.position_m[j];
        std::printf("  %s %.6f %.6f %.6f\n", pose->skeleton->joint_name(j).c_str(),
                    static_cast<double>(at[0]), static_cast<double>(at[1]),
                    static_cast<double>(at[2]));
      }
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "watch: %s\n", error.what());
    return 1;
  }
  return 0;
}
