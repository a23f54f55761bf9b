#include <cstdio>
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::tools {

void add_keygen(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("keygen", "Make a key pair: NAME.key (secret) and NAME.pub");
  struct Options {
    std::string name;
    std::filesystem::path folder = ".";
  };
  auto options = std::make_shared<Options>();
  command->add_option("name", options->name, "Whose keys: server, viewer, ...")->required();
  command->add_option("--out", options->folder, "The folder to write to")
      ->capture_default_str()
      ->type_name("DIR");
  command->footer(R"(Examples:
  posed keygen server --out keys     # name keys/server.key as server_key in the config
  posed keygen viewer                # give viewer.pub to the operator of the daemon
NAME.key never leaves its machine. An existing file is not overwritten.)");
  command->callback([options, &exit_code] {
    const auto pair = net::write_new_keys(options->name, options->folder);
    if (!pair) {
      exit_code = report(pair.error());
      return;
    }
    const auto path = [&](const char* end) {
      return (options->folder / (options->name + end)).lexically_normal().string();
    };
    std::printf("%s (secret)\n%s\n", path(".key").c_str(), path(".pub").c_str());
  });
}

}  // namespace posed::tools
