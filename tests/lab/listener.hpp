// A client of the daemon under test, which judges every Sample of every stream as it comes.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace posed::lab {

struct Heard {
  std::uint64_t samples = 0;
  std::uint64_t mixed = 0;    // raw values of more than one report, or of none
  std::uint64_t skipped = 0;  // reports of one session that did not come
  std::uint64_t gaps = 0;     // in the stream's own numbers
  std::int64_t last_ns = 0;   // arrival of the newest at the daemon
};

class Listener {
 public:
  // `modulus[stream]`: report n has n % modulus in every sensor.
  Listener(const std::string& endpoint, std::map<std::string, std::uint32_t> modulus);

  [[nodiscard]] Heard heard(const std::string& stream) const;
  // What comes next need not follow on what came before: the glove starts anew.
  void new_session(const std::string& stream);

 private:
  struct State {
    Heard heard;
    std::uint32_t modulus = 1;
    std::uint64_t sequence = 0;
    std::uint32_t value = 0;
    bool follows = false;  // value is of this session
  };

  void listen(const std::stop_token& stop, const std::string& endpoint);
  void take(std::string_view bytes);

  mutable std::mutex mutex_;
  std::map<std::string, State> states_;
  std::jthread thread_;
};

}  // namespace posed::lab
