// `posed relay`: passes on what daemons publish, so that many subscribers cost each of them one
// connection.
#include "daemon/tools/relay/relay.hpp"
#include "daemon/tools/command/findings.hpp"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include "daemon/config/config.hpp"
#include "daemon/logging/log_output.hpp"
#include "daemon/net/peer_guard.hpp"
#include "daemon/net/security.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/run/serve.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::tools {
namespace {

constexpr std::int64_t kLookAround_ns = kNanosPerSecond / 20;  // for signals
constexpr std::chrono::milliseconds kLineWithin{300};

struct RelayCommand {
  std::vector<std::string> from;
  std::string bind = "tcp://127.0.0.1:5580";
  std::filesystem::path key;
  std::vector<std::filesystem::path> server_keys;
  std::filesystem::path security;
  std::optional<double> seconds;
  bool insecure = false;
  bool json = false;
};

// Without a file the relay has no keys for its subscribers.
Result<config::SecurityConfig> relay_security(const RelayCommand& command) {
  if (!command.security.empty()) {
    if (command.insecure) {
      return misuse("--insecure has no effect beside --security: leave one of them out");
    }
    return config::load_security(command.security);
  }
  if (net::is_loopback(command.bind)) {
    if (!command.insecure) return config::SecurityConfig{};
    return misuse("--insecure has no effect at " + command.bind +
                  ", which only this machine reaches: leave it out");
  }
  if (command.insecure) return config::SecurityConfig{};
  return misuse(net::open_to_anyone(command.bind) +
                "; name a file with a server_key in [security] (--security), or say --insecure");
}

Result<std::vector<link::Peer>> upstreams_of(const RelayCommand& command) {
  const std::size_t keys = command.server_keys.size();
  if (keys > 1 && keys != command.from.size()) {
    return misuse(
        fmt::format("--server-key is given {} times: give it once for all, or once for"
                    " each --from, in their order",
                    keys));
  }
  std::vector<link::Peer> upstreams;
  for (std::size_t i = 0; i < command.from.size(); ++i) {
    link::Peer& upstream = upstreams.emplace_back();
    upstream.endpoint = command.from[i];
    if (upstream.endpoint == command.bind) {
      return misuse(upstream.endpoint +
                    " is both --from and --bind, so the relay would hear itself"
                    " alone; bind it to another port");
    }
    upstream.key = command.key;
    if (keys > 0) upstream.server_key = command.server_keys[keys == 1 ? 0 : i];
  }
  return upstreams;
}

void print_line(const Findings& findings) {
  const std::string line = findings.json();
  if (!logging::write_within(STDOUT_FILENO, line + '\n', kLineWithin)) {
    spdlog::warn("a line cannot be written to stdout: {}", line);
  }
}

// What passed in the last second, for people on a terminal, or as JSON.
class CounterLine {
 public:
  CounterLine(const relay::Relay& relay, bool as_json)
      : relay_(relay), json_(as_json), shows_(as_json || isatty(STDERR_FILENO) != 0) {}
  ~CounterLine() {
    if (drawn_) logging::say("");
  }
  CounterLine(const CounterLine&) = delete;
  CounterLine& operator=(const CounterLine&) = delete;

  void show(std::int64_t now_ns) {
    if (!shows_ || now_ns < shown_ns_ + kNanosPerSecond) return;
    const relay::RelayCounts counts = relay_.counts();
    const auto since = static_cast<double>(counts.messages - messages_before_);
    const double rate_hz = shown_ns_ == 0 ? 0.0 : since / seconds(now_ns - shown_ns_);
    shown_ns_ = now_ns;
    messages_before_ = counts.messages;
    if (json_) return print_json(counts, rate_hz);
    drawn_ = true;
    const unsigned long long dropped = counts.foreign + counts.clashes;
    std::fprintf(stderr,
                 "\r\033[K%zu of %zu upstreams, %zu streams, %zu subscribers, %.0f messages/s"
                 ", dropped %llu",
                 counts.upstreams, upstreams_, counts.streams, counts.subscribers, rate_hz,
                 dropped);
  }
  void upstreams(std::size_t count) { upstreams_ = count; }

 private:
  static void print_json(const relay::RelayCounts& counts, double rate_hz) {
    print_line(Findings()
                   .add("upstreams", counts.upstreams)
                   .add("streams", counts.streams)
                   .add("subscribers", counts.subscribers)
                   .add("subscriptions", counts.subscriptions)
                   .add("messages", counts.messages)
                   .add("messages_per_s", rate_hz)
                   .add("bytes", counts.bytes)
                   .add("late_skeletons", counts.late_skeletons)
                   .add("foreign", counts.foreign)
                   .add("clashes", counts.clashes)
                   .add("stats_left_out", counts.stats_left_out));
  }

  const relay::Relay& relay_;
  bool json_;
  bool shows_;
  bool drawn_ = false;
  std::size_t upstreams_ = 0;
  std::int64_t shown_ns_ = 0;
  std::uint64_t messages_before_ = 0;
};

// Ends with SIGINT or SIGTERM. SIGHUP reads the list of clients again, as in `posed run`.
void serve_relay(relay::Relay& relay, net::ZapAuthenticator& authenticator,
                 const RelayCommand& command) {
  const sigset_t set = end_signals();
  const timespec at_once{};
  CounterLine line(relay, command.json);
  line.upstreams(command.from.size());
  const std::int64_t start_ns = system::monotonic_ns();
  while (true) {
    const std::int64_t now_ns = system::monotonic_ns();
    if (command.seconds && seconds(now_ns - start_ns) >= *command.seconds) return;
    const std::int64_t due_ns = relay.turn(now_ns);
    line.show(now_ns);
    relay.wait(std::min(due_ns - now_ns, kLookAround_ns));
    const int signal = sigtimedwait(&set, nullptr, &at_once);
    if (signal <= 0) continue;
    if (signal != SIGHUP || command.security.empty()) {
      spdlog::info("{}: ending", signal == SIGINT ? "interrupted" : "terminated");
      return;
    }
    const auto security = config::load_security(command.security);
    if (!security) {
      spdlog::error("the client list stays as it was: {}", security.error().text());
    } else if (authenticator.replace(net::AccessList(security->clients))) {
      relay.check_subscribers();
    }
  }
}

Result<> run_relay(const RelayCommand& command) {
  prepare_to_serve();
  const auto security = TRY(relay_security(command));
  auto upstreams = TRY(upstreams_of(command));
  net::raise_file_limit();
  const auto context = TRY(net::open_context());
  relay::RelayOptions options{
      .context = context.get(), .from = std::move(upstreams), .endpoint = command.bind};
  std::optional<net::AccessList> allowed;  // empty without keys
  if (!security.server_key.empty()) {
    auto keys = TRY(net::read_secret_key(security.server_key));
    options.secret_z85 = keys.secret_z85;
    allowed.emplace(security.clients);
  }
  const auto authenticator = TRY(net::ZapAuthenticator::start(context.get(), std::move(allowed)));
  options.authenticator = authenticator.get();
  const auto relay = TRY(relay::Relay::open(options));
  print_line(
      Findings().add("ready", true).add("publish", relay->endpoint()).add("from", command.from));
  serve_relay(*relay, *authenticator, command);
  return {};
}

}  // namespace

void add_relay(CLI::App& app, int& exit_code) {
  auto* command =
      app.add_subcommand("relay", "Pass on what daemons publish, to any number of subscribers");
  auto options = std::make_shared<RelayCommand>();
  command->add_option("--from", options->from, "A daemon's publish endpoint; several: merged")
      ->required()
      ->type_name("ENDPOINT");
  command->add_option("--bind", options->bind, "Where subscribers connect")
      ->capture_default_str()
      ->type_name("ENDPOINT");
  auto* key =
      command->add_option("--key", options->key, "Own secret key for the daemons (NAME.key)");
  auto* server =
      command->add_option("--server-key", options->server_keys,
                          "The daemon's public key (NAME.pub); once, or for each --from");
  key->type_name("FILE")->needs(server);
  server->type_name("FILE")->needs(key);
  command
      ->add_option("--security", options->security,
                   "TOML with [security]: the relay's own key, and who may subscribe")
      ->type_name("FILE");
  command->add_flag("--insecure", options->insecure, "Let other machines subscribe without a key");
  command->add_option("--seconds", options->seconds, "End after so many seconds")
      ->type_name("SECONDS")
      ->check(above_zero());
  command->add_flag("--json", options->json, "One JSON object of counters a second on stdout");
  command->footer(
      R"(Once ready it prints one line of JSON on stdout with the endpoint really bound. Examples:
  posed relay --from tcp://127.0.0.1:5570 --bind tcp://127.0.0.1:5580
  posed monitor --connect tcp://127.0.0.1:5580           # as from the daemon itself
  posed relay --from tcp://192.168.1.10:5570 --from tcp://192.168.1.11:5570 --key relay.key \
      --server-key server.pub --security relay.toml --bind tcp://0.0.0.0:5580
A subscriber gets the skeletons of its streams within 0.1 s. The relay never holds poses back: a
subscriber too slow for the stream misses frames. Streams of one name come from the first daemon
that sends them; the others' are counted as clashes. SIGHUP reads the clients again.)");
  command->callback([options, &exit_code] { exit_code = report(run_relay(*options)); });
}

}  // namespace posed::tools
