#include "tests/bench/sptk.hpp"

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>

namespace posed::bench {

Result<SptkRun> run_sptk(const SptkInput& input, int range, const std::filesystem::path& folder) {
  if (!std::filesystem::exists(kSptkMlpg)) {
    return fail("SPTK's mlpg is not installed: apt-get install sptk", kSptkMlpg);
  }
  const auto in = folder / "sptk.in";
  const auto out = folder / "sptk.out";
  std::ofstream(in, std::ios::binary)
      .write(reinterpret_cast<const char*>(input.values.data()),
             static_cast<std::streamsize>(input.values.size() * sizeof(float)));
  const std::string command = std::string(kSptkMlpg) + " -l " + std::to_string(input.channels) +
                              " -i 0 -s " + std::to_string(range) + " -d -0.5 0 0.5 -d 1 -2 1 <'" +
                              in.string() + "' >'" + out.string() + "'";
  const auto start = std::chrono::steady_clock::now();
  const int status = std::system(command.c_str());
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  if (status != 0) return fail("SPTK's mlpg failed", kSptkMlpg);
  SptkRun run;
  run.seconds = taken.count();
  run.trajectory.resize(std::filesystem::file_size(out) / sizeof(float));
  std::ifstream(out, std::ios::binary)
      .read(reinterpret_cast<char*>(run.trajectory.data()),
            static_cast<std::streamsize>(run.trajectory.size() * sizeof(float)));
  return run;
}

}  // namespace posed::bench
