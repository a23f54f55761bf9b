// LineClients: programs that connect over TCP to get lines of text. Each gets whole lines only: one
// that does not read fast enough misses whole lines, and one that has taken nothing for two seconds
// is disconnected. What clients send is discarded.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/output/send_outcome.hpp"
#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::output {

// One thread. No call waits.
class LineClients {
 public:
  static constexpr std::size_t kMostClients = 16;

  // Listens on "127.0.0.1:7002"; port 0: any. Beyond loopback `peers` must name who may connect.
  // Cold.
  [[nodiscard]] static Result<LineClients> open(const std::string& listen,
                                                std::vector<std::string> peers);
  ~LineClients();
  LineClients(LineClients&& other) noexcept;
  LineClients& operator=(LineClients&&) = delete;
  LineClients(const LineClients&) = delete;
  LineClients& operator=(const LineClients&) = delete;

  [[nodiscard]] const std::string& endpoint() const noexcept { return endpoint_; }  // the bound one
  [[nodiscard]] std::size_t size() const noexcept { return clients_.size(); }

  // What each client gets before its first line; empty: nothing. Clients that got another one are
  // disconnected, because they could not make sense of what follows.
  void set_greeting(std::string greeting);

  [[nodiscard]] SendOutcome send(std::string_view line, std::int64_t now_ns);

  // Lets clients in, looks which have gone, and disconnects those that take nothing. Returns what
  // people should know, one sentence each. Call it every kLook_ns.
  [[nodiscard]] std::vector<std::string> look(std::int64_t now_ns);
  static constexpr std::int64_t kLook_ns = kNanosPerSecond / 20;

 private:
  struct Client {
    int fd = -1;
    std::string from{};  // its address
    std::string rest{};  // of the line that it has taken a part of
    bool greeted = false;
    bool gone = false;
    std::int64_t stuck_ns = kNoTime_ns;  // since when it has taken nothing of what it should
  };
  LineClients() = default;
  void let_in(std::int64_t now_ns, std::vector<std::string>& news);
  void refuse(const drivers::Address& peer, const std::string& why, std::int64_t now_ns,
              std::vector<std::string>& news);
  // Returns whether nothing of the client's last line waits any more.
  static bool write_rest(Client& client);
  // Writes as much of the text as the client takes; the rest of it goes out before anything else.
  // Returns false if it takes nothing.
  static bool write(Client& client, std::string_view text);
  void remove_gone();

  int listener_ = -1;
  std::string endpoint_, greeting_;
  std::vector<std::string> peers_;
  std::vector<Client> clients_;
  std::int64_t told_ns_ = kNoTime_ns;  // when a refusal was last told
};

}  // namespace posed::output
