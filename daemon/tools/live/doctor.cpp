// `posed doctor`: what of this computer is right for posed, what is wrong, and the line that mends
// it.
#include "daemon/tools/doctor/doctor.hpp"
#include "daemon/tools/command/findings.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/config/config.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/paint.hpp"

namespace posed::tools {
namespace {

struct DoctorCommand {
  std::filesystem::path config;
  bool json = false;
};

// The line is like "ok     usb latency            no USB adapter with a latency timer is here"; a
// fix has a line of its own, which can be copied whole.
Findings findings_of(const doctor::Check& check, bool coloured) {
  std::string mark = check.ok ? paint(coloured, kGreen, "ok   ") : paint(coloured, kRed, "WRONG");
  if (!check.looked) mark = "-    ";
  Findings findings;
  findings.add("name", check.name)
      .add("ok", check.ok)
      .add("found", check.found)
      .add("fix", check.fix)
      .say(fmt::format("{}  {:<22}  {}", mark, check.name, check.found));
  return check.ok ? findings : findings.say("       " + paint(coloured, kBold, check.fix));
}

Findings findings_of(const std::vector<doctor::Check>& checks) {
  const bool coloured = isatty(STDOUT_FILENO) == 1;
  std::vector<Findings> rows;
  for (const doctor::Check& check : checks) rows.push_back(findings_of(check, coloured));
  const auto bad = std::ranges::count(checks, false, &doctor::Check::ok);
  const auto looked = std::ranges::count(checks, true, &doctor::Check::looked);
  return Findings()
      .add("ok", bad == 0)
      .add("checks", rows)
      .say(bad == 0 ? fmt::format("all {} that were looked at are right", looked)
                    : fmt::format("{} of {} need{} mending: the line below each says how", bad,
                                  looked, bad == 1 ? "s" : ""));
}

int examine_this_machine(const DoctorCommand& command) {
  std::optional<config::DaemonConfig> config;
  if (!command.config.empty()) {
    auto loaded = config::load_config(command.config, drivers::registry());
    if (!loaded) return report(loaded.error());
    config = std::move(*loaded);
  }
  const auto checks = doctor::examine(doctor::this_machine(), config ? &*config : nullptr);
  findings_of(checks).show(command.json, -1);
  const bool ok = std::ranges::all_of(checks, &doctor::Check::ok);
  return static_cast<int>(ok ? ExitCode::kDone : ExitCode::kFailed);
}

}  // namespace

void add_doctor(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("doctor", "Say what is wrong on this computer, and the cure");
  auto options = std::make_shared<DoctorCommand>();
  command->add_option("--config", options->config, "Look at what this config needs, too")
      ->type_name("FILE");
  command->add_flag("--json", options->json, "All checks as one JSON object");
  command->footer(
      R"(It looks at the rights to devices, real-time priorities and locked memory, USB latency,
ModemManager, CPU and clock; with --config also at socket buffers, disk, ports, keys, models
and logs. It changes nothing, and opens no device. Examples:
  posed doctor                                   this computer alone
  posed doctor --config mine.toml                before the show, while posed does not run
  posed doctor --json | jq '.checks[] | select(.ok | not)'
What does not apply is ok and says why; what was not looked at has a dash. Run it as the user
that runs posed. Exit code 0: all is right. 1: something needs mending. 2: the config is wrong
(`posed check` says more).)");
  command->callback([options, &exit_code] { exit_code = examine_this_machine(*options); });
}

}  // namespace posed::tools
