#include "proto/zmq/keys.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {
namespace {

constexpr std::size_t kMaxKeyFile = 256;  // bytes; a longer file is not a key and a newline

class File {
 public:
  explicit File(int fd) : fd_(fd) {}
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] bool ok() const { return fd_ >= 0; }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

Result<std::string> read_key(const File& file, const std::filesystem::path& path) {
  if (!file.ok()) return fail("cannot read the key: " + errno_text(), path);
  std::array<char, kMaxKeyFile> buffer{};
  const ssize_t size = read(file.get(), buffer.data(), buffer.size());
  if (size < 0) return fail("cannot read the key: " + errno_text(), path);
  std::string text(buffer.data(), size);
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  if (!is_key(text)) {
    return fail("this is not a key: expected the 40 characters that `posed keygen` writes", path);
  }
  return text;
}

// Creates the file with this mode; never follows a link and never overwrites a file.
Result<> write_key(const std::filesystem::path& path, const std::string& key, mode_t mode) {
  const File file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!file.ok()) {
    if (errno == EEXIST) {
      return fail("exists already and is not overwritten; choose another name or move it away",
                  path);
    }
    return fail("cannot write the key: " + errno_text(), path);
  }
  const std::string line = key + "\n";
  const bool written = write(file.get(), line.data(), line.size()) == ssize_t(line.size());
  if (written && fsync(file.get()) == 0) return {};
  const std::string why = errno_text();
  unlink(path.c_str());
  return fail("cannot write the key: " + why, path);
}

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' &&
         name.find('/') == std::string_view::npos;
}

}  // namespace

bool is_key(const std::string& text) {
  std::array<std::uint8_t, 32> decoded{};
  return text.size() == kKeyLength && text.find('\0') == std::string::npos &&
         zmq_z85_decode(decoded.data(), text.c_str()) != nullptr;
}

Result<KeyPair> write_new_keys(const std::string& name, const std::filesystem::path& folder) {
  if (!is_plain_name(name)) {
    return misuse("'" + name +
                  "' is not a name for a key: use letters, digits, '-' and '_'"
                  " (--out names the folder)");
  }
  std::array<char, kKeyLength + 1> public_z85{};
  std::array<char, kKeyLength + 1> secret_z85{};
  if (zmq_curve_keypair(public_z85.data(), secret_z85.data()) != 0) {
    return fail("this libzmq was built without CURVE; install Debian's libzmq5");
  }
  KeyPair pair{public_z85.data(), secret_z85.data()};
  std::error_code made;
  std::filesystem::create_directories(folder, made);
  if (made) return fail("cannot make the folder: " + made.message(), folder);
  const auto secret_path = folder / (name + ".key");
  TRY(write_key(secret_path, pair.secret_z85, 0600));
  if (auto done = write_key(folder / (name + ".pub"), pair.public_z85, 0644); !done) {
    unlink(secret_path.c_str());
    return std::unexpected(done.error());
  }
  return pair;
}

Result<KeyPair> read_secret_key(const std::filesystem::path& path) {
  if (path.extension() == ".pub") {
    return misuse("this is the public half; name the .key file here", path);
  }
  const File file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat about{};
  const bool is_file = file.ok() && fstat(file.get(), &about) == 0 && S_ISREG(about.st_mode);
  if (is_file && (about.st_mode & 077) != 0) {
    return fail(
        "others can read this secret key; make a new one with `posed keygen`, or, if nobody"
        " did, run: chmod 600 " +
            path.string(),
        path);
  }
  auto secret = TRY(read_key(file, path));
  std::array<char, kKeyLength + 1> public_z85{};
  if (zmq_curve_public(public_z85.data(), secret.c_str()) != 0) {
    return fail("this libzmq was built without CURVE; install Debian's libzmq5");
  }
  return KeyPair{public_z85.data(), secret};
}

Result<std::string> read_public_key(const std::filesystem::path& path) {
  if (path.extension() == ".key") {
    return misuse(
        "this is the secret half, which never leaves its machine; name the .pub file"
        " here",
        path);
  }
  return read_key(File(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)), path);
}

Result<> secure_client(void* socket, const std::filesystem::path& key_file,
                       const std::filesystem::path& server_key_file) {
  const auto own = TRY(read_secret_key(key_file));
  const auto server = TRY(read_public_key(server_key_file));
  for (const Result<>& set : {set_option(socket, ZMQ_CURVE_SERVERKEY, server),
                              set_option(socket, ZMQ_CURVE_PUBLICKEY, own.public_z85),
                              set_option(socket, ZMQ_CURVE_SECRETKEY, own.secret_z85)}) {
    if (!set) return set;
  }
  return {};
}

}  // namespace posed::net
