// Upkeep: a transport whose link needs something now and then that costs more system calls than the
// reader thread may make. The device's supervisor thread does it.
#pragma once

#include <cstdint>
#include <string>

namespace posed::drivers {

class Upkeep {
 public:
  virtual ~Upkeep() = default;

  // Call it a few times a second, from one thread; another one may read and send meanwhile. Cold.
  virtual void upkeep(std::int64_t now_ns) noexcept = 0;

  // What people should know about the link: a sentence for the log, or nothing. Given once. From
  // the same thread. Cold.
  [[nodiscard]] virtual std::string consume_note() { return {}; }
};

}  // namespace posed::drivers
