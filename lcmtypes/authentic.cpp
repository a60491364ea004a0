#include "lcmtypes/authentic.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

namespace forereach {
namespace {

constexpr std::string_view kMark = "FRSIGNED";
constexpr std::string_view kKeyPrefix = "forereach-key-1 ";
constexpr std::size_t kTagBytes = 32, kNumberBytes = 8;
static_assert(kSignatureBytes == 2 * kNumberBytes + kTagBytes + kMark.size());
constexpr std::size_t kKeyFileBytes = kKeyPrefix.size() + 2 * sizeof(Key256) + 1;

// `covered`: the message, the sender and the counter.
Digest TagOf(const Key256& key, const std::string& channel, Bytes covered) {
  crypto_generichash_state state;
  crypto_generichash_init(&state, key.data(), key.size(), kTagBytes);
  const auto size = BigEndian<std::uint64_t>(channel.size());
  crypto_generichash_update(&state, size.data(), size.size());
  crypto_generichash_update(&state, reinterpret_cast<const std::uint8_t*>(channel.data()), channel.size());
  crypto_generichash_update(&state, covered.data(), covered.size());
  Digest tag;
  crypto_generichash_final(&state, tag.data(), tag.size());
  return tag;
}

bool IsSigned(Bytes bytes) {
  return bytes.size() >= kSignatureBytes &&
         std::memcmp(bytes.data() + bytes.size() - kMark.size(), kMark.data(), kMark.size()) == 0;
}

// A file descriptor that closes itself.
class File final {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

[[noreturn]] void Fail(const std::string& path, const std::string& why) { throw KeyError("key " + path + ": " + why); }

}  // namespace

void MakeKeyFile(const std::string& path) {
  if (sodium_init() < 0) Fail(path, "the machine has no random numbers to make it of");
  Key256 key;
  randombytes_buf(key.data(), key.size());
  const std::string text = std::string(kKeyPrefix) + ToHex(key) + "\n";
  const File file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (file.get() < 0) Fail(path, std::string("cannot be made: ") + std::strerror(errno));
  errno = ENOSPC;  // what a short write means
  if (::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(file.get()) == 0) return;
  const std::string why = std::strerror(errno);
  ::unlink(path.c_str());
  Fail(path, "cannot be written: " + why);
}

Key256 LoadKey(const std::string& path) {
  const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0) Fail(path, std::string("cannot be read: ") + std::strerror(errno));
  if (!S_ISREG(status.st_mode)) Fail(path, "is no regular file");
  if (status.st_uid != ::geteuid() && status.st_uid != 0) Fail(path, "belongs to somebody else");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) Fail(path, "others can read or write it; do: chmod 600 " + path);
  std::array<char, kKeyFileBytes + 1> text;
  const ssize_t size = ::read(file.get(), text.data(), text.size());
  Key256 key;
  std::size_t bytes = 0;
  if (size != static_cast<ssize_t>(kKeyFileBytes) || text[kKeyFileBytes - 1] != '\n' ||
      std::memcmp(text.data(), kKeyPrefix.data(), kKeyPrefix.size()) != 0 ||
      sodium_hex2bin(key.data(), key.size(), text.data() + kKeyPrefix.size(), 2 * key.size(), nullptr, &bytes, nullptr) != 0 ||
      bytes != key.size())
    Fail(path, "holds no key; `forereach keygen " + path + "` makes one");
  return key;
}

Bytes WithoutSignature(Bytes bytes) { return IsSigned(bytes) ? bytes.first(bytes.size() - kSignatureBytes) : bytes; }

Signer::Signer(const Key256& key, const std::string& name, std::int64_t begun_us) : key_(key) {
  const Digest digest = DigestOf(name + " " + std::to_string(begun_us) + " " + std::to_string(::getpid()));
  sender_ = FromBigEndian<std::uint64_t>(digest);
}

std::vector<std::uint8_t> Signer::Sign(const std::string& channel, Bytes message, std::int64_t now_us) {
  std::int64_t last = last_counter_, counter = 0;
  do counter = std::max(now_us, last + 1);
  while (!last_counter_.compare_exchange_weak(last, counter));
  std::vector<std::uint8_t> bytes;
  bytes.reserve(message.size() + kSignatureBytes);
  const auto append = [&](const auto& part) { bytes.insert(bytes.end(), part.begin(), part.end()); };
  append(message);
  append(BigEndian(sender_));
  append(BigEndian(counter));
  append(TagOf(key_, channel, bytes));
  append(kMark);
  return bytes;
}

std::pair<Authenticity, Bytes> Authenticator::Check(const std::string& channel, Bytes bytes) {
  const Authenticity authenticity = Judge(channel, bytes);
  switch (authenticity) {
    case Authenticity::kAuthentic: return {authenticity, WithoutSignature(bytes)};
    case Authenticity::kUnsigned: ++refusals_.unsigned_ones; break;
    case Authenticity::kForged: ++refusals_.forged; break;
    case Authenticity::kReplayed: ++refusals_.replayed; break;
  }
  return {authenticity, {}};
}

Authenticity Authenticator::Judge(const std::string& channel, Bytes bytes) {
  if (!IsSigned(bytes)) return Authenticity::kUnsigned;
  const std::size_t covered = bytes.size() - kTagBytes - kMark.size();
  const Digest tag = TagOf(key_, channel, bytes.first(covered));
  if (sodium_memcmp(tag.data(), bytes.data() + covered, kTagBytes) != 0) return Authenticity::kForged;
  const std::uint64_t sender = FromBigEndian<std::uint64_t>(bytes.subspan(covered - 2 * kNumberBytes));
  const auto counter = FromBigEndian<std::int64_t>(bytes.subspan(covered - kNumberBytes));
  return TakeCounter(channel, sender, counter) ? Authenticity::kAuthentic : Authenticity::kReplayed;
}

bool Authenticator::TakeCounter(const std::string& channel, std::uint64_t sender, std::int64_t counter) {
  const auto known = last_counter_.find({channel, sender});
  if (counter <= (known == last_counter_.end() ? oldest_ : known->second)) return false;
  if (known != last_counter_.end()) {
    known->second = counter;
    return true;
  }
  if (last_counter_.size() >= kMaxStreams) {  // what is forgotten must not be taken a second time
    const auto silent = std::ranges::min_element(last_counter_, {}, [](const auto& stream) { return stream.second; });
    oldest_ = std::max(oldest_, silent->second);
    last_counter_.erase(silent);
    if (counter <= oldest_) return false;
  }
  last_counter_.emplace(std::pair(channel, sender), counter);
  return true;
}

}  // namespace forereach
