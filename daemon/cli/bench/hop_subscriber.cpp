#include "daemon/cli/bench/hop_subscriber.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <map>

#include "daemon/system/clock.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::cli {
namespace {

constexpr int kPoll_ms = 50;
constexpr std::size_t kReserved = 1 << 20;  // number of messages for which memory is reserved

std::string read_line(int fd) {
  std::string line;
  for (char c = 0; ::read(fd, &c, 1) == 1 && c != '\n';) line.push_back(c);
  return line;
}

bool write_all(int fd, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(fd, bytes, size);
    if (written <= 0) return false;
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool read_all(int fd, void* data, std::size_t size) {
  auto* bytes = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t count = ::read(fd, bytes, size);
    if (count <= 0) return false;
    bytes += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

// Runs in the child process.
class Noter {
 public:
  Noter() { noted_.messages.reserve(kReserved); }

  // Receives one message if there is one.
  bool take(void* socket) {
    net::Message topic;
    if (!topic.receive(socket)) return false;
    net::Message body;
    if (!body.receive(socket, 0)) return false;
    const std::int64_t came_ns = system::monotonic_ns();
    if (topic.text().starts_with("bare/")) {
      std::int64_t arrival_ns = 0;
      std::memcpy(&arrival_ns, body.bytes().data(), sizeof arrival_ns);
      noted_.messages.push_back({arrival_ns, came_ns - arrival_ns, true});
    } else if (frame_.ParseFromArray(body.bytes().data(), static_cast<int>(body.bytes().size()))) {
      noted_.messages.push_back({frame_.arrival_ns(), came_ns - frame_.arrival_ns(), false});
      std::uint64_t& last = last_[frame_.stream()];
      if (last != 0 && frame_.sequence() > last + 1) noted_.gaps += frame_.sequence() - last - 1;
      last = frame_.sequence();
    }
    return true;
  }

  [[nodiscard]] const ReceivedMessages& noted() const { return noted_; }

 private:
  ReceivedMessages noted_;
  v1::Frame frame_;
  std::map<std::string, std::uint64_t> last_;  // sequence by stream
};

int note_until_stopped(int from_parent, int to_parent) {
  const std::string pipeline_endpoint = read_line(from_parent);
  const std::string bare_endpoint = read_line(from_parent);
  auto context = net::open_context();
  if (!context) return 1;
  auto socket = net::open_socket(context->get(), ZMQ_SUB);
  if (!socket) return 1;
  for (const char* topic : {"pose/", "bare/"}) {
    if (!net::set_option(socket->get(), ZMQ_SUBSCRIBE, std::string_view(topic))) return 1;
  }
  for (const std::string& endpoint : {pipeline_endpoint, bare_endpoint}) {
    if (!net::connect_socket(socket->get(), endpoint)) return 1;
  }
  Noter noter;
  std::array<zmq_pollitem_t, 2> wait{
      {{socket->get(), 0, ZMQ_POLLIN, 0}, {nullptr, from_parent, ZMQ_POLLIN, 0}}};
  while ((wait[1].revents & (ZMQ_POLLIN | ZMQ_POLLERR)) == 0) {
    zmq_poll(wait.data(), static_cast<int>(wait.size()), kPoll_ms);
    while (noter.take(socket->get())) {
    }
  }
  const ReceivedMessages& noted = noter.noted();
  const bool sent =
      write_all(to_parent, &noted.gaps, sizeof noted.gaps) &&
      write_all(to_parent, noted.messages.data(), noted.messages.size() * sizeof(Arrival));
  return sent ? 0 : 1;
}

}  // namespace

Result<std::unique_ptr<HopSubscriber>> HopSubscriber::fork() {
  std::array<int, 2> down{};
  std::array<int, 2> up{};
  if (pipe2(down.data(), O_CLOEXEC) != 0 || pipe2(up.data(), O_CLOEXEC) != 0) {
    return fail("cannot make a pipe: " + errno_text());
  }
  const int process = ::fork();
  if (process < 0) return fail("cannot fork: " + errno_text());
  if (process == 0) {
    close(down[1]);
    close(up[0]);
    _exit(note_until_stopped(down[0], up[1]));
  }
  close(down[0]);
  close(up[1]);
  return std::unique_ptr<HopSubscriber>(new HopSubscriber(process, down[1], up[0]));
}

HopSubscriber::~HopSubscriber() {
  if (to_ >= 0) close(to_);
  close(from_);
  waitpid(process_, nullptr, 0);
}

void HopSubscriber::begin(const std::string& pipeline_endpoint, const std::string& bare_endpoint) {
  const std::string lines = pipeline_endpoint + "\n" + bare_endpoint + "\n";
  static_cast<void>(write_all(to_, lines.data(), lines.size()));
}

Result<ReceivedMessages> HopSubscriber::finish() {
  close(to_);
  to_ = -1;
  ReceivedMessages received;
  if (!read_all(from_, &received.gaps, sizeof received.gaps)) {
    return fail("the subscriber's process ended early");
  }
  for (Arrival arrival; read_all(from_, &arrival, sizeof arrival);) {
    received.messages.push_back(arrival);
  }
  return received;
}

}  // namespace posed::cli
