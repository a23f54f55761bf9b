#include "daemon/tools/command/client.hpp"

#include <csignal>
#include <cstdio>
#include <utility>

#include <google/protobuf/util/json_util.h>
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/system/clock.hpp"
#include "daemon/tools/command/options.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

constexpr double kSilence_s = 3.0;       // three stats messages are missing
constexpr double kFirstSilence_s = 1.5;  // a running daemon sends something within a second

}  // namespace

void Heartbeat::beat(std::int64_t now_ns) {
  if (reported_s_ > 0.0) returned_ = seconds(now_ns - last_ns_);
  reported_s_ = 0.0;
  last_ns_ = now_ns;
  ever_beat_ = true;
}

std::optional<double> Heartbeat::silent_s(std::int64_t now_ns) const {
  const double silence_s = seconds(now_ns - last_ns_);
  if (silence_s < (ever_beat_ ? kSilence_s : kFirstSilence_s)) return std::nullopt;
  return silence_s;
}

std::optional<double> Heartbeat::silence_to_report(std::int64_t now_ns) {
  const auto silence_s = silent_s(now_ns);
  if (!silence_s || *silence_s < 2.0 * reported_s_) return std::nullopt;
  reported_s_ = *silence_s;
  return silence_s;
}

std::optional<double> Heartbeat::return_to_report() {
  return std::exchange(returned_, std::nullopt);
}

namespace {

using net::Domain;

// A client must never show old poses, so only few messages may wait anywhere.
constexpr link::Limits kLimits{.messages = 16, .receive_buffer = 8 * 1024};

volatile std::sig_atomic_t interrupt_came = 0;

}  // namespace

void add_client_options(CLI::App& command, ClientOptions& options, const char* endpoint) {
  options.endpoint = endpoint;
  command.add_option("--connect", options.endpoint, "The daemon's endpoint")
      ->capture_default_str()
      ->type_name("ENDPOINT");
  auto* key = command.add_option("--key", options.key, "Own secret key (NAME.key)");
  auto* server =
      command.add_option("--server-key", options.server_key, "The daemon's public key (NAME.pub)");
  key->type_name("FILE")->needs(server);
  server->type_name("FILE")->needs(key);
}

Result<Connection> Connection::open(const ClientOptions& options, int type) {
  auto context = TRY(net::open_context());
  auto socket = TRY(link::DaemonSocket::open(context.get(), type, options, kLimits));
  return Connection(std::move(context), std::move(socket));
}

Result<> Connection::subscribe(const std::string& prefix, bool wanted) {
  if (wanted) {
    wanted_.insert(prefix);
  } else {
    wanted_.erase(prefix);
  }
  return net::set_option(socket_.get(), wanted ? ZMQ_SUBSCRIBE : ZMQ_UNSUBSCRIBE, prefix);
}

bool Connection::send(const std::string& request) {
  return net::send_part(socket_.get(), request, false);
}

bool Connection::wait(std::chrono::milliseconds timeout) {
  zmq_pollitem_t item{socket_.get(), 0, ZMQ_POLLIN, 0};
  return zmq_poll(&item, 1, timeout.count()) > 0;
}

std::optional<Error> Connection::refusal() {
  const std::int64_t now_ns = system::monotonic_ns();
  const std::uint64_t cuts = socket_.cuts(), ends = socket_.ends();
  const std::string why = socket_.refusal();
  cuts_ += socket_.cuts() - cuts;
  if (!why.empty()) return fail("the daemon at " + endpoint() + " " + why).error();
  if (socket_.domain() != Domain::kPublish) return std::nullopt;
  if (socket_.ends() != ends) retry_.failed(now_ns);
  if (retry_.due(now_ns, established())) open_anew();
  return std::nullopt;
}

// If that fails it is tried again.
void Connection::open_anew() {
  auto fresh = link::DaemonSocket::open(context_.get(), ZMQ_SUB, socket_.peer(), kLimits);
  if (!fresh) return;
  std::swap(socket_, *fresh);  // an assignment would end the old socket before its monitor
  retry_.opened();
  cuts_ = 0;
  for (const std::string& prefix : wanted_) static_cast<void>(subscribe(prefix));
}

namespace {

constexpr const char* kSentTooMuch =
    "it sent more than any daemon does, so its connection was ended";

}  // namespace

Error Connection::no_answer() const {
  const bool control = socket_.domain() == Domain::kControl;
  if (cuts_ > 0) {
    return fail("what answers at " + endpoint() + " is no posed daemon: " + kSentTooMuch).error();
  }
  if (established()) {
    return fail("the daemon at " + endpoint() + " does not answer; is this its " +
                (control ? "control" : "publish") + " endpoint?")
        .error();
  }
  const char* const hint = control ? " (a replay publishes, but takes no control)"
                                   : " (by default 5570 publishes, 5571 takes control)";
  return fail("nothing answers at " + endpoint() +
              "; is `posed run` going, and is this its endpoint?" + hint)
      .error();
}

std::string Connection::silence(double silence_s, bool cut) const {
  const char* why = "the daemon has ended, or cannot be reached";
  if (established()) why = "the connection stands, but the daemon is stopped or stuck";
  return fmt::format("no answer for {:.0f} s: {}", silence_s, cut ? kSentTooMuch : why);
}

SilenceWatch::SilenceWatch(const Connection& connection, double timeout_s)
    : connection_(connection), timeout_s_(timeout_s), heart_(system::monotonic_ns()) {}

void SilenceWatch::beat() {
  heart_.beat(system::monotonic_ns());
  cuts_ = connection_.cuts();
}

std::string SilenceWatch::sentence(double silence_s) const {
  if (!heart_.ever_beat()) return connection_.no_answer().message;
  return connection_.silence(silence_s, connection_.cuts() != cuts_);
}

std::optional<std::string> SilenceWatch::silence() const {
  const auto silence_s = heart_.silent_s(system::monotonic_ns());
  if (!silence_s) return std::nullopt;
  return sentence(*silence_s);
}

std::optional<Error> SilenceWatch::report() {
  const std::int64_t now_ns = system::monotonic_ns();
  const std::string before = heart_.ever_beat() ? connection_.endpoint() + ": " : "";
  const auto silence_s = heart_.silent_s(now_ns);
  if (timeout_s_ > 0.0 && silence_s && *silence_s >= timeout_s_) {
    return fail(fmt::format("{}{}; gave up after {} s (--timeout)", before, sentence(*silence_s),
                            timeout_s_))
        .error();
  }
  const auto news_s = heart_.silence_to_report(now_ns);
  if (news_s && prints_) {
    std::fprintf(stderr, "posed: %s%s\n",
                 heart_.ever_beat() ? before.c_str() : "waiting: ", sentence(*news_s).c_str());
  }
  if (const auto back_s = heart_.return_to_report(); back_s && prints_) {
    std::fprintf(stderr, "posed: %s answers again, after %.0f s\n", connection_.endpoint().c_str(),
                 *back_s);
  }
  return std::nullopt;
}

void add_timeout_option(CLI::App& command, double& timeout_s) {
  command
      .add_option("--timeout", timeout_s,
                  "End with exit code 1 when the daemon has not answered for so many seconds;"
                  " without it, wait")
      ->type_name("SECONDS")
      ->check(in_range(2.0, 1e6));
}

Interrupt::Interrupt() {
  struct sigaction action{};
  // no SA_RESTART, so that the signal ends a wait
  action.sa_handler = [](int) { interrupt_came = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool Interrupt::came() { return interrupt_came != 0 || std::ferror(stdout) != 0; }

std::string to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, options).ok()) return "{}";
  return clean_json(text);
}

bool print_json(const google::protobuf::Message& message) {
  const std::string line = to_json(message) + "\n";
  return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
         std::fflush(stdout) == 0;
}

}  // namespace posed::tools
