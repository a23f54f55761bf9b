// `posed view`: serves the page that shows a running daemon in a browser.

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include "daemon/logging/log_output.hpp"
#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/live/page.hpp"
#include "daemon/tools/run/serve.hpp"
#include "daemon/tools/view/bridge.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr std::chrono::milliseconds kUrlWithin{300};

struct ViewCommand {
  ClientOptions client;
  std::string control;
  std::string address = "127.0.0.1";
  std::optional<std::uint16_t> port;
  std::filesystem::path page;
  bool read_only = false;
  bool no_browser = false;
  bool json = false;
};

std::string reason_of(const ViewCommand& command) {
  if (command.read_only) return "this page was opened with --read-only";
  if (!command.control.empty()) return {};
  return "this page knows no control endpoint: give `posed view` --control ENDPOINT";
}

Result<> warn_of_network(const ViewCommand& command) {
  const auto own = TRY(view::is_loopback_address(command.address));
  if (own) return {};
  logging::say(fmt::format(
      "posed: warning: other machines reach this page on {}: whoever has its address can see the"
      " streams{}, and everybody on the way can read that address, for HTTP is not encrypted; an"
      " SSH tunnel to 127.0.0.1 is safer",
      clean_name(command.address), command.read_only ? "" : " and change them"));
  return {};
}

// Shows where the page is.
void print_url(const view::Bridge& bridge, const ViewCommand& command) {
  const Findings ready = Findings().add("ready", true).add("url", bridge.url());
  const std::string text = command.json ? ready.json() : bridge.url();
  if (!logging::write_within(STDOUT_FILENO, text + '\n', kUrlWithin)) {
    spdlog::warn("the page's address cannot be written to stdout");
  }
  if (command.json || command.no_browser) return;
  if (!command.client.key.empty()) {
    logging::say(
        "posed: open it yourself: a browser that posed starts shows the address to every"
        " user of this machine, in its list of processes");
    return;
  }
  open_browser(bridge.url());
}

Result<> serve_page(const ViewCommand& command) {
  prepare_to_serve();
  const auto page = TRY(find_page(command.page));
  TRY(warn_of_network(command));
  view::BridgeOptions options{.link = {.publish = command.client,
                                       .control = command.control,
                                       .read_only_reason = reason_of(command)},
                              .page = page,
                              .address = command.address};
  options.port = command.port.value_or(view::kUsualPort);
  options.or_any_port = !command.port;
  const auto bridge = TRY(view::Bridge::start(options));
  print_url(*bridge, command);
  const sigset_t set = end_signals();
  while (sigwaitinfo(&set, nullptr) < 0) {  // interrupted: stopped and continued
  }
  return {};
}

}  // namespace

void add_view(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("view", "Show a running daemon in the browser");
  auto options = std::make_shared<ViewCommand>();
  add_client_options(*command, options->client, kOwnPublish);
  command
      ->add_option("--control", options->control,
                   std::string("The daemon's control endpoint, to change streams (default: ") +
                       kOwnControl + " for the daemon of this computer, otherwise none)")
      ->type_name("ENDPOINT");
  command
      ->add_option("--port", options->port,
                   fmt::format("TCP port of the page; 0: any free one (default: {}, or any free"
                               " one if that is in use)",
                               view::kUsualPort))
      ->type_name("PORT")
      ->check(in_range(0, std::numeric_limits<std::uint16_t>::max()));
  command
      ->add_option("--bind", options->address,
                   "Address of the page; others than 127.0.0.1 let"
                   " other machines in")
      ->capture_default_str()
      ->type_name("ADDRESS");
  command->add_option("--page", options->page, "The folder of the page (default: the one built)")
      ->type_name("FOLDER");
  command->add_flag("--read-only", options->read_only, "Show only: the page can change nothing");
  command->add_flag("--no-browser", options->no_browser, "Print the address, open no browser");
  command->add_flag("--json", options->json,
                    "Print {\"ready\": true, \"url\": ...} and open no browser");
  command->footer(R"(Examples:
  posed view                                    # the daemon of this computer
  posed view --read-only --no-browser
  posed view --connect tcp://stage:5570 --control tcp://stage:5571 --key me.key --server-key s.pub
  ssh -L 5580:127.0.0.1:5580 stage              # then open, here, the address printed there
It prints the page's address. Its token is new at every start; only who has it sees the streams. The
page shows bodies and hands, latency and drops, and changes alpha, models, gestures and takes as
`posed ctl` does; with keys, only if yours may control. It follows at the speed of your screen and
never slows the daemon down, and it reconnects when the daemon restarts. Ctrl-C ends it.)");
  command->callback([options, &exit_code] {
    // Another daemon's streams may have the same names.
    if (options->control.empty() && options->client.endpoint == kOwnPublish) {
      options->control = kOwnControl;
    }
    exit_code = report(serve_page(*options));
  });
}

}  // namespace posed::tools
