// Link: the messages between the ranks of one `mpirun`. Each is a kind and bytes, those of one
// sender come in its order, and waiting costs no CPU. One thread uses it. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace posed::mpi {

enum class Kind : std::uint8_t {
  kInputs,    // leader: what it was started with and reads
  kCompared,  // answer: what differs here; empty if nothing does
  kDone,      // how many tasks of this round are done here
  kResults,   // of this rank's tasks
  kAll,       // leader: the results of all tasks
  kStop,      // leader: no rank shall go on
  kLeft,      // the command has ended here; its last words
};

struct Message {
  int from = 0;
  Kind kind{};
  std::vector<std::byte> bytes;

  [[nodiscard]] std::string_view text() const {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
};

class Link {
 public:
  // Joins the other ranks; without mpirun this process is the only one.
  Link();
  // Waits for all ranks.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return static_cast<int>(hosts_.size()); }
  [[nodiscard]] std::string name(int rank) const;  // "rank 2 on hostb"
  [[nodiscard]] int ranks_here() const;            // on this rank's machine

  // Returns when the other rank receives, or earlier.
  void send(int to, Kind kind, std::span<const std::byte> bytes = {});
  void send(int to, Kind kind, std::string_view text) {
    send(to, kind, std::as_bytes(std::span(text)));
  }

  // The next message that has come, from anybody.
  [[nodiscard]] std::optional<Message> poll();
  // Waits for it.
  [[nodiscard]] Message next();

 private:
  int rank_ = 0;
  std::vector<std::string> hosts_;  // [rank]
};

}  // namespace posed::mpi
