// LineClients: programs that connect over TCP to read lines of text. Each gets whole lines only: a
// client that does not read fast enough misses whole lines, and one that reads nothing for two
// seconds while lines wait is disconnected. Bytes from clients are discarded.
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
  static constexpr std::size_t kMaxClients = 16;

  // Listens on an address such as "127.0.0.1:7002"; for port 0 the system chooses one. Beyond
  // loopback `peers` must name the addresses that may connect. `people`: of whom lines go out
  // together. Cold.
  static Result<LineClients> open(const std::string& listen, const std::vector<std::string>& peers,
                                  std::size_t people = 1);
  ~LineClients();
  LineClients(LineClients&& other) noexcept;
  LineClients& operator=(LineClients&&) = delete;
  LineClients(const LineClients&) = delete;
  LineClients& operator=(const LineClients&) = delete;

  [[nodiscard]] const std::string& endpoint() const noexcept { return endpoint_; }  // as bound
  [[nodiscard]] std::size_t size() const noexcept { return clients_.size(); }

  // Sets the text that each client gets before its first line. Clients that got another greeting
  // are disconnected, because they would misread the lines that follow.
  void set_greeting(std::string greeting);

  // Sends the line, or another message, to each client that has got all of its last one.
  [[nodiscard]] SendOutcome send(std::string_view line, std::int64_t now_ns);

  // Admits clients, removes those that have gone, and disconnects those that read nothing. Returns
  // news for users. Call it every kLook_ns.
  [[nodiscard]] std::vector<News> look(std::int64_t now_ns);
  static constexpr std::int64_t kLook_ns = kNanosPerSecond / 20;

 private:
  struct Client {
    int fd = -1;
    std::string from{};  // its address
    std::string rest{};  // the part of its last line that it has not read yet
    bool greeted = false;
    bool gone = false;
    std::int64_t stuck_ns = kNoTime_ns;  // since when it has read nothing although bytes wait
  };
  LineClients() = default;
  void let_in(std::int64_t now_ns, std::vector<News>& news);
  void refuse(const drivers::Address& peer, const std::string& why, std::int64_t now_ns,
              std::vector<News>& news);
  // Writes the rest of the client's last line. Returns whether all of it is written.
  static bool write_rest(Client& client);
  // Writes as much of the text as the socket accepts; the rest is sent before anything else.
  // Returns false if the socket accepts nothing.
  static bool write(Client& client, std::string_view text);
  void remove_gone();

  int listener_ = -1;
  std::string endpoint_, greeting_;
  drivers::Peers peers_;
  int buffer_bytes_ = 0;  // of a client's socket
  std::vector<Client> clients_;
  std::int64_t reported_ns_ = kNoTime_ns;  // when look() last told of a refusal
};

}  // namespace posed::output
