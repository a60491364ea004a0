#include "bus/keys.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <dirent.h>
#include <fcntl.h>
#include <sodium.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bus/descriptor.h"
#include "lcmtypes/printable.h"

namespace forereach {
namespace {

constexpr std::string_view kKeyFormat = "forereach-key-2", kVerifyFormat = "forereach-verify-2",
                           kVerifyFile = "verify.pub";
constexpr std::size_t kMaxName = 64, kMaxFileBytes = 2048;
constexpr std::string_view kNameSigns = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";

using SecretKey = std::array<std::uint8_t, 32>;
static_assert(sizeof(SecretKey) == crypto_sign_SEEDBYTES && sizeof(SecretKey) == crypto_generichash_KEYBYTES);
static_assert(sizeof(PublicKey) == crypto_sign_PUBLICKEYBYTES && sizeof(Signature) == crypto_sign_BYTES);
static_assert(sizeof(GroupTag) == crypto_generichash_BYTES_MIN);

struct Secrets {
  std::array<SecretKey, kAllRoles.size()> seed;
  std::array<std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES>, kAllRoles.size()> key;  // made of the seeds
  SecretKey group;
};

std::size_t At(Role role) { return static_cast<std::size_t>(role) - 1; }
std::string FileOf(Role role) { return std::string(RoleName(role)) + ".key"; }

[[noreturn]] void Fail(const std::string& path, const std::string& why) { throw KeyError("key " + path + ": " + why); }
[[noreturn]] void FailSystem(const std::string& path, const std::string& what) {
  Fail(path, what + ": " + std::strerror(errno));
}

void RequireSodium(const std::string& path) {
  if (sodium_init() < 0) Fail(path, "libsodium cannot begin: the machine gives no random numbers");
}

void RequireName(const std::string& path, const std::string& where, std::string_view name) {
  if (name.empty() || name.size() > kMaxName || name.find_first_not_of(kNameSigns) != name.npos)
    Fail(path,
         where + "a robot's name has to be 1 to " + std::to_string(kMaxName) + " letters, digits, '.', '_' or '-'");
}

// Text with secrets, which is wiped at the end. It never grows, so no unwiped copy is left.
class SecretText final {
 public:
  SecretText() { text_.reserve(kMaxFileBytes + 1); }
  ~SecretText() { sodium_memzero(text_.data(), text_.capacity()); }
  SecretText(const SecretText&) = delete;
  SecretText& operator=(const SecretText&) = delete;

  void Append(std::string_view word) { text_.append(word.substr(0, kMaxFileBytes - text_.size())); }
  void AppendLine(std::string_view field, std::string_view value) {
    Append(field);
    Append(" ");
    Append(value);
    Append("\n");
  }
  void AppendLine(std::string_view field, const SecretKey& key) {
    std::array<char, 2 * sizeof(SecretKey) + 1> hex;
    sodium_bin2hex(hex.data(), hex.size(), key.data(), key.size());
    AppendLine(field, std::string_view(hex.data(), hex.size() - 1));
    sodium_memzero(hex.data(), hex.size());
  }
  [[nodiscard]] std::string_view view() const { return text_; }

 private:
  std::string text_;
};

}  // namespace

struct KeyRing::Content {
  std::string robot;
  std::array<PublicKey, kAllRoles.size()> public_keys{};
  std::array<bool, kAllRoles.size()> holds{};
  bool holds_group = false;
  Secrets* secrets;  // zero where not held

  Content() : secrets(static_cast<Secrets*>(sodium_malloc(sizeof(Secrets)))) {
    if (!secrets) throw std::bad_alloc();
    sodium_memzero(secrets, sizeof *secrets);
  }
  ~Content() { sodium_free(secrets); }
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  void Hold(Role role, const SecretKey& seed) {
    const std::size_t i = At(role);
    secrets->seed[i] = seed;
    crypto_sign_seed_keypair(public_keys[i].data(), secrets->key[i].data(), secrets->seed[i].data());
    holds[i] = true;
  }
};

std::string_view RoleName(Role role) {
  switch (role) {
    case Role::kCertifier: return "certifier";
    case Role::kPlanner: return "planner";
    case Role::kPerception: return "perception";
    case Role::kRobot: return "robot";
    case Role::kOperator: return "operator";
    case Role::kLogger: return "logger";
  }
  return "unknown";
}

// ---- The ring.

const std::string& KeyRing::robot() const { return content_->robot; }
const PublicKey& KeyRing::public_key(Role role) const { return content_->public_keys[At(role)]; }
bool KeyRing::Holds(Role role) const { return content_->holds[At(role)]; }
bool KeyRing::HoldsGroup() const { return content_->holds_group; }

KeyRing KeyRing::Public() const {
  auto content = std::make_shared<Content>();
  content->robot = robot();
  content->public_keys = content_->public_keys;
  return KeyRing(std::move(content));
}

Signature KeyRing::Sign(Role role, Bytes bytes) const {
  if (!Holds(role)) throw std::logic_error("KeyRing: the secret of " + std::string(RoleName(role)) + " is not held");
  Signature signature;
  crypto_sign_detached(signature.data(), nullptr, bytes.data(), bytes.size(), content_->secrets->key[At(role)].data());
  return signature;
}

bool KeyRing::IsSigned(Role role, Bytes bytes, const Signature& signature) const {
  return crypto_sign_verify_detached(signature.data(), bytes.data(), bytes.size(), public_key(role).data()) == 0;
}

GroupTag KeyRing::Tag(Bytes bytes) const {
  if (!HoldsGroup()) throw std::logic_error("KeyRing: the group key is not held");
  GroupTag tag;
  const SecretKey& group = content_->secrets->group;
  crypto_generichash(tag.data(), tag.size(), bytes.data(), bytes.size(), group.data(), group.size());
  return tag;
}

bool operator==(const KeyRing& a, const KeyRing& b) {
  const KeyRing::Content &x = *a.content_, &y = *b.content_;
  return x.robot == y.robot && x.public_keys == y.public_keys && x.holds == y.holds && x.holds_group == y.holds_group &&
         sodium_memcmp(x.secrets, y.secrets, sizeof(Secrets)) == 0;
}

namespace {

std::shared_ptr<KeyRing::Content> MakeContent(const std::string& robot, const Digest& entropy) {
  const std::string what = "of robot " + robot.substr(0, kMaxName);
  RequireSodium(what);
  RequireName(what, "", robot);
  auto content = std::make_shared<KeyRing::Content>();
  content->robot = robot;
  const auto derive = [&](std::string_view purpose, SecretKey& key) {
    crypto_generichash(key.data(), key.size(), reinterpret_cast<const std::uint8_t*>(purpose.data()), purpose.size(),
                       entropy.data(), entropy.size());
  };
  SecretKey seed;
  for (const Role role : kAllRoles) {
    derive(RoleName(role), seed);
    content->Hold(role, seed);
  }
  sodium_memzero(seed.data(), seed.size());
  derive("group", content->secrets->group);
  content->holds_group = true;
  return content;
}

}  // namespace

KeyRing MakeKeyRing(const std::string& robot, const Digest& entropy) { return KeyRing(MakeContent(robot, entropy)); }

// ---- Files.

namespace {

void AppendPublicKeys(SecretText& text, const KeyRing::Content& content) {
  for (const Role role : kAllRoles)
    text.AppendLine("public " + std::string(RoleName(role)), content.public_keys[At(role)]);
}

// Reads the lines of a file in turn.
class LineReader final {
 public:
  LineReader(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

  [[nodiscard]] std::string_view Line() {
    ++line_;
    const std::size_t end = rest_.find('\n');
    if (end == rest_.npos) Complain("is missing, or does not end with a line's end");
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return line;
  }
  // The text after `field` and a space.
  [[nodiscard]] std::string_view Value(const std::string& field) {
    const std::string_view line = Line();
    if (!line.starts_with(field + " ")) Complain("has to begin with \"" + field + " \"");
    return line.substr(field.size() + 1);
  }
  [[nodiscard]] SecretKey KeyOf(const std::string& field) {
    const std::string_view hex = Value(field);
    SecretKey key{};
    std::size_t bytes = 0;
    const bool plain = hex.size() == 2 * sizeof(SecretKey) && hex.find_first_not_of("0123456789abcdef") == hex.npos;
    if (!plain || sodium_hex2bin(key.data(), key.size(), hex.data(), hex.size(), nullptr, &bytes, nullptr) != 0 ||
        bytes != key.size())
      Complain(field + ": has to be 64 lower-case hexadecimal digits");
    return key;
  }
  void RequireEnd() {
    ++line_;
    if (!rest_.empty()) Complain("the file has to end before it");
  }
  // The message does not contain the value, which may be a secret.
  [[noreturn]] void Complain(const std::string& why) const {
    Fail(path_, "line " + std::to_string(line_) + ": " + why);
  }
  [[nodiscard]] std::string where() const { return "line " + std::to_string(line_) + ": "; }

 private:
  const std::string& path_;
  std::string_view rest_;
  int line_ = 0;
};

Role ReadRole(LineReader& reader) {
  const std::string_view name = reader.Value("role");
  const auto role = std::ranges::find(kAllRoles, name, RoleName);
  if (role == kAllRoles.end())
    reader.Complain("role: has to be certifier, planner, perception, robot, operator or logger");
  return *role;
}

void ReadPublicKeys(LineReader& reader, KeyRing::Content& content, std::optional<Role> own) {
  for (const Role role : kAllRoles) {
    const std::string field = "public " + std::string(RoleName(role));
    const PublicKey key = reader.KeyOf(field);
    if (own == role && key != content.public_keys[At(role)])
      reader.Complain(field + ": is not that of the secret in line 4");
    // A role with another's key could speak for it.
    for (std::size_t other = 0; other < At(role); ++other)
      if (content.public_keys[other] == key) reader.Complain(field + ": is another role's key too");
    if (own && At(*own) > At(role) && key == content.public_keys[At(*own)])
      reader.Complain(field + ": is the key of " + std::string(RoleName(*own)) + " too");
    content.public_keys[At(role)] = key;
  }
}

struct KeyFile {
  std::shared_ptr<KeyRing::Content> content;
  std::optional<Role> role;  // none in verify.pub
};

KeyFile Parse(const std::string& path, std::string_view text) {
  LineReader reader(path, text);
  const std::string_view format = reader.Line();
  if (format != kKeyFormat && format != kVerifyFormat)
    reader.Complain("has to be " + std::string(kKeyFormat) + " or " + std::string(kVerifyFormat) +
                    "; `forereach keygen` makes keys");
  KeyFile file{std::make_shared<KeyRing::Content>(), std::nullopt};
  const std::string_view robot = reader.Value("robot");
  RequireName(path, reader.where() + "robot: ", robot);
  file.content->robot = robot;
  if (format == kKeyFormat) {
    file.role = ReadRole(reader);
    SecretKey seed = reader.KeyOf("secret");
    file.content->Hold(*file.role, seed);
    sodium_memzero(seed.data(), seed.size());
    file.content->secrets->group = reader.KeyOf("group");
    file.content->holds_group = true;
  }
  ReadPublicKeys(reader, *file.content, file.role);
  reader.RequireEnd();
  return file;
}

bool IsDirectory(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

// Checks the open file, so that the checked file is the one that is read.
KeyFile Load(const std::string& path) {
  RequireSodium(path);
  // A pipe is opened without waiting, and a terminal does not become this process's own.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0) FailSystem(path, "cannot be read");
  if (!S_ISREG(status.st_mode)) Fail(path, "is no regular file");
  if (status.st_uid != ::geteuid() && status.st_uid != 0) Fail(path, "belongs to another user");
  if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0) Fail(path, "others can write it; do: chmod go-w " + path);
  SecretText text;
  std::array<char, kMaxFileBytes> buffer;
  const ssize_t size = ::read(file.get(), buffer.data(), buffer.size());
  if (size >= 0) text.Append({buffer.data(), static_cast<std::size_t>(size)});
  sodium_memzero(buffer.data(), buffer.size());
  if (size < 0) FailSystem(path, "cannot be read");
  KeyFile key = Parse(path, text.view());
  if (key.role && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    Fail(path, "others can read it, and there is a secret in it; do: chmod 600 " + path);
  return key;
}

// A new file of the directory, on the disk.
void WriteNew(int directory, const std::string& path, const std::string& name, mode_t mode, std::string_view text) {
  const Descriptor file(::openat(directory, name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
  errno = file.get() < 0 ? errno : ENOSPC;  // a short write means a full disk
  if (file.get() < 0 || ::fchmod(file.get(), mode) != 0 ||
      ::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()) || ::fsync(file.get()) != 0)
    FailSystem(path + "/" + name, "cannot be written");
}

void WriteAll(int directory, const std::string& path, const KeyRing::Content& content) {
  for (const Role role : kAllRoles) {
    SecretText text;
    text.Append(kKeyFormat);
    text.Append("\n");
    text.AppendLine("robot", content.robot);
    text.AppendLine("role", RoleName(role));
    text.AppendLine("secret", content.secrets->seed[At(role)]);
    text.AppendLine("group", content.secrets->group);
    AppendPublicKeys(text, content);
    WriteNew(directory, path, FileOf(role), S_IRUSR | S_IWUSR, text.view());
  }
  SecretText text;
  text.Append(kVerifyFormat);
  text.Append("\n");
  text.AppendLine("robot", content.robot);
  AppendPublicKeys(text, content);
  WriteNew(directory, path, std::string(kVerifyFile), S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH, text.view());
  if (::fsync(directory) != 0) FailSystem(path, "cannot be written");
}

void SyncParent(const std::string& path) {
  std::string parent = path;
  while (parent.size() > 1 && parent.back() == '/') parent.pop_back();
  const std::size_t slash = parent.rfind('/');
  parent = slash == parent.npos ? "." : parent.substr(0, std::max<std::size_t>(slash, 1));
  const Descriptor directory(::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0 || ::fsync(directory.get()) != 0) FailSystem(path, "cannot be written");
}

}  // namespace

void MakeKeys(const std::string& robot, const std::string& directory) {
  RequireSodium(directory);
  RequireName(directory, "\"" + Printable(robot.substr(0, kMaxName + 1)) + "\": ", robot);
  if (::mkdir(directory.c_str(), S_IRWXU) != 0) FailSystem(directory, "cannot be made");
  try {
    if (::chmod(directory.c_str(), S_IRWXU) != 0) FailSystem(directory, "cannot be made");  // whatever the umask
    const Descriptor handle(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (handle.get() < 0) FailSystem(directory, "cannot be made");
    Digest entropy;
    randombytes_buf(entropy.data(), entropy.size());
    const auto content = MakeContent(robot, entropy);
    sodium_memzero(entropy.data(), entropy.size());
    WriteAll(handle.get(), directory, *content);
    SyncParent(directory);
  } catch (...) {
    for (const Role role : kAllRoles) ::unlink((directory + "/" + FileOf(role)).c_str());
    ::unlink((directory + "/" + std::string(kVerifyFile)).c_str());
    ::rmdir(directory.c_str());
    throw;
  }
}

// ---- A new key for one role.

namespace {

// A directory of keys, and what it is exchanged for. Holds the parent directory, locked against other calls.
class KeyDirectory final {
 public:
  explicit KeyDirectory(const std::string& directory) : path_(Resolve(directory)) {
    const std::size_t slash = path_.rfind('/');
    name_ = path_.substr(slash + 1);
    other_ = "." + name_ + ".replacing";
    parent_path_ = path_.substr(0, std::max<std::size_t>(slash, 1));
    parent_.emplace(::open(parent_path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (parent_->get() < 0) FailSystem(parent_path_, "cannot be read");
    if (::flock(parent_->get(), LOCK_EX | LOCK_NB) != 0)
      Fail(path_, errno == EWOULDBLOCK ? "another `forereach keygen --again` is at work here"
                                       : std::string("cannot be locked: ") + std::strerror(errno));
  }

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string other_path() const { return path_.substr(0, path_.rfind('/') + 1) + other_; }

  void RequireOnlyKeys() const {
    const std::unique_ptr<DIR, int (*)(DIR*)> listing(::opendir(path_.c_str()), ::closedir);
    if (!listing) FailSystem(path_, "cannot be read");
    std::string stranger;
    int keys = 0;
    while (const dirent* entry = ::readdir(listing.get())) {
      const std::string name = entry->d_name;
      if (name == "." || name == "..") continue;
      if (std::ranges::count(KeyFiles(), name) > 0)
        ++keys;
      else
        stranger = name;
    }
    if (keys == 0) Fail(path_, "there are no keys in it; without --again, `forereach keygen` makes a new directory");
    if (!stranger.empty())
      Fail(path_ + "/" + Printable(stranger), "is no key file; --again needs a directory that holds nothing else");
  }

  void WriteOther(const KeyRing::Content& content) const {
    if (::mkdirat(parent_->get(), other_.c_str(), S_IRWXU) != 0) FailSystem(other_path(), "cannot be made");
    if (::fchmodat(parent_->get(), other_.c_str(), S_IRWXU, 0) != 0)  // whatever the umask
      FailSystem(other_path(), "cannot be made");
    const Descriptor handle(::openat(parent_->get(), other_.c_str(), kOpenDirectory));
    if (handle.get() < 0) FailSystem(other_path(), "cannot be made");
    WriteAll(handle.get(), other_path(), content);
  }

  void Exchange() const {
    // In one step: at no time has a directory keys of the old and the new set.
    if (::renameat2(parent_->get(), other_.c_str(), parent_->get(), name_.c_str(), RENAME_EXCHANGE) != 0)
      FailSystem(path_, "cannot be exchanged for " + other_path() +
                            ", which needs a file system that exchanges directories in one step");
  }
  void Sync() const {
    if (::fsync(parent_->get()) != 0) FailSystem(parent_path_, "cannot be written");
  }

  // @throws KeyError if there is something else than keys in it, or it cannot be removed.
  void RemoveOther() const {
    const Descriptor handle(::openat(parent_->get(), other_.c_str(), kOpenDirectory));
    if (handle.get() < 0 && errno == ENOENT) return;
    if (handle.get() < 0) FailSystem(other_path(), "cannot be removed");
    for (const std::string& name : KeyFiles())
      if (::unlinkat(handle.get(), name.c_str(), 0) != 0 && errno != ENOENT)
        FailSystem(other_path() + "/" + name, "cannot be removed");
    if (::unlinkat(parent_->get(), other_.c_str(), AT_REMOVEDIR) != 0) FailSystem(other_path(), "cannot be removed");
    Sync();
  }

 private:
  static constexpr int kOpenDirectory = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

  static std::string Resolve(const std::string& directory) {
    const std::unique_ptr<char, void (*)(void*)> path(::realpath(directory.c_str(), nullptr), std::free);
    if (!path) FailSystem(directory, "cannot be read");
    if (!IsDirectory(path.get())) Fail(directory, "is no directory; --again needs the directory of all keys");
    return path.get();
  }
  static std::vector<std::string> KeyFiles() {
    std::vector<std::string> names{std::string(kVerifyFile)};
    for (const Role role : kAllRoles) names.push_back(FileOf(role));
    return names;
  }

  const std::string path_;
  std::string name_, other_, parent_path_;
  std::optional<Descriptor> parent_;
};

// The secrets of all roles but one, whose file may be missing.
std::shared_ptr<KeyRing::Content> LoadAllBut(Role lost, const std::string& directory) {
  const KeyFile verify = Load(directory + "/" + std::string(kVerifyFile));
  if (verify.role) Fail(directory + "/" + std::string(kVerifyFile), "line 1: has to be " + std::string(kVerifyFormat));
  const std::shared_ptr<KeyRing::Content> all = verify.content;
  for (const Role role : kAllRoles) {
    const std::string path = directory + "/" + FileOf(role);
    if (role == lost && ::access(path.c_str(), F_OK) != 0 && errno == ENOENT) continue;
    const KeyFile key = Load(path);
    if (key.role != role) Fail(path, "line 3: role: has to be " + std::string(RoleName(role)));
    if (all->robot != key.content->robot || all->public_keys != key.content->public_keys)
      Fail(path, "belongs to other keys than " + std::string(kVerifyFile) + " in the same directory");
    const SecretKey& group = key.content->secrets->group;
    if (all->holds_group && sodium_memcmp(group.data(), all->secrets->group.data(), sizeof group) != 0)
      Fail(path, "line 5: group: is not that of the other files in the same directory");
    all->secrets->group = group;
    all->holds_group = true;
    all->Hold(role, key.content->secrets->seed[At(role)]);
  }
  return all;
}

}  // namespace

void ReplaceKey(const std::string& robot, const std::string& directory, Role role) {
  RequireSodium(directory);
  const KeyDirectory keys(directory);
  keys.RequireOnlyKeys();
  const std::shared_ptr<KeyRing::Content> content = LoadAllBut(role, keys.path());
  if (content->robot != robot)
    Fail(directory, "the keys are of robot " + content->robot + ", not of " + Printable(robot.substr(0, kMaxName + 1)));
  keys.RemoveOther();
  SecretKey seed;
  randombytes_buf(seed.data(), seed.size());
  content->Hold(role, seed);
  sodium_memzero(seed.data(), seed.size());
  try {
    keys.WriteOther(*content);
    keys.Exchange();
  } catch (...) {
    try {
      keys.RemoveOther();
    } catch (const KeyError&) {  // the next call does
    }
    throw;
  }
  try {
    keys.Sync();
    keys.RemoveOther();
  } catch (const KeyError& error) {
    Fail(directory, "the new keys are in place, but see to it that the old ones in " + keys.other_path() +
                        " are gone: " + error.what());
  }
}

KeyRing LoadKeys(const std::string& path, Role role) {
  const std::string file = IsDirectory(path) ? path + "/" + FileOf(role) : path;
  KeyFile key = Load(file);
  if (!key.role) Fail(file, "contains only public keys; this program needs " + FileOf(role));
  if (*key.role != role)
    Fail(file, "line 3: role: is " + std::string(RoleName(*key.role)) + ", this program speaks as " +
                   std::string(RoleName(role)) + ": give it " + FileOf(role) + " or the directory of the keys");
  return KeyRing(std::move(key.content));
}

KeyRing LoadAllKeys(const std::string& directory) {
  if (!IsDirectory(directory))
    Fail(directory, "is no directory; this program speaks for all roles and needs the directory of the keys");
  auto all = std::make_shared<KeyRing::Content>();
  for (const Role role : kAllRoles) {
    const std::string path = directory + "/" + FileOf(role);
    const KeyFile key = Load(path);
    const KeyRing::Content& one = *key.content;
    if (key.role != role) Fail(path, "line 3: role: has to be " + std::string(RoleName(role)));
    if (role == kAllRoles.front()) {
      all->robot = one.robot;
      all->public_keys = one.public_keys;
      all->secrets->group = one.secrets->group;
    } else if (all->robot != one.robot || all->public_keys != one.public_keys ||
               sodium_memcmp(all->secrets->group.data(), one.secrets->group.data(), sizeof(SecretKey)) != 0) {
      Fail(path, "belongs to other keys than " + FileOf(kAllRoles.front()) + " in the same directory");
    }
    all->Hold(role, one.secrets->seed[At(role)]);
  }
  all->holds_group = true;
  return KeyRing(std::move(all));
}

KeyRing LoadPublicKeys(const std::string& path) {
  std::string file = path;
  if (IsDirectory(path)) {
    std::vector<std::string> names{std::string(kVerifyFile)};
    for (const Role role : kAllRoles) names.push_back(FileOf(role));
    const auto there = std::ranges::find_if(
        names, [&](const std::string& name) { return ::access((path + "/" + name).c_str(), F_OK) == 0; });
    file += "/" + (there == names.end() ? names.front() : *there);
  }
  return KeyRing(Load(file).content).Public();
}

}  // namespace forereach
