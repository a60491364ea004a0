/** The keys of one robot. Each role has a secret of its own, so a message says which role sent it, and the secret of
one role makes nothing that counts as another's. `forereach keygen` makes a directory:

    certifier.key planner.key perception.key robot.key operator.key logger.key     mode 0600
    verify.pub                                                                     no secret in it

A .key file holds what one role needs: its own secret, the group key, and the public keys of all roles. verify.pub holds
the public keys alone: it is enough to judge a log. A file is text; every line is there once, in this order, and ends
with '\n':

    forereach-key-2                      verify.pub: forereach-verify-2
    robot NAME                           1 to 64 letters, digits, '.', '_' or '-'
    role ROLE                            not in verify.pub
    secret SEED                          the role's Ed25519 seed; not in verify.pub
    group KEY                            not in verify.pub
    public certifier KEY                 and so on, one line a role, in the order above

Keys are 32 bytes in lower-case hexadecimal. The group key keeps strangers out cheaply (authentic.h); whoever holds it
alone can make nothing that counts. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"

namespace forereach {

/** Keys cannot be made or used; the text names the file, the line and the field, and what it has to be. */
class KeyError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** Numbers are part of every signature and never change. */
enum class Role : std::uint8_t {
  kCertifier = 1,
  kPlanner = 2,
  kPerception = 3,
  kRobot = 4,
  kOperator = 5,
  kLogger = 6
};

inline constexpr std::array kAllRoles{Role::kCertifier, Role::kPlanner,  Role::kPerception,
                                      Role::kRobot,     Role::kOperator, Role::kLogger};

/** "certifier", "planner", ... */
[[nodiscard]] std::string_view RoleName(Role role);

using PublicKey = std::array<std::uint8_t, 32>;
using Signature = std::array<std::uint8_t, 64>;
using GroupTag = std::array<std::uint8_t, 16>;

/** The keys that a program holds. Secrets stay inside, in memory that no core dump contains; copies share them. */
class KeyRing final {
 public:
  struct Content;  // private to keys.cpp
  explicit KeyRing(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

  [[nodiscard]] const std::string& robot() const;
  [[nodiscard]] const PublicKey& public_key(Role role) const;
  /** Whether it holds the role's secret. */
  [[nodiscard]] bool Holds(Role role) const;
  /** Whether it holds the group key: every ring but one of public keys. */
  [[nodiscard]] bool HoldsGroup() const;

  /** Ed25519 of `bytes` by the role. @throws std::logic_error if the ring does not hold its secret. */
  [[nodiscard]] Signature Sign(Role role, Bytes bytes) const;
  [[nodiscard]] bool IsSigned(Role role, Bytes bytes, const Signature& signature) const;
  /** Keyed BLAKE2b-128 of `bytes` with the group key. @throws std::logic_error if the ring does not hold it. */
  [[nodiscard]] GroupTag Tag(Bytes bytes) const;

  /** The same robot, secrets, group key and public keys; secrets are compared in constant time. */
  friend bool operator==(const KeyRing& a, const KeyRing& b);

 private:
  std::shared_ptr<const Content> content_;
};

/** New keys of all roles, all made from `entropy`: the same entropy gives the same keys.
@throws KeyError if `robot` is no name, or libsodium cannot begin. */
[[nodiscard]] KeyRing MakeKeyRing(const std::string& robot, const Digest& entropy);

/** Makes keys of a robot from the machine's random numbers, in a new directory that only its owner can read.
@throws KeyError if `directory` exists or cannot be written; then nothing is left behind. */
void MakeKeys(const std::string& robot, const std::string& directory);

/** The ring of one role. @param path a directory, of which ROLE.key is read, or one .key file.
@throws KeyError if the file cannot be read, is no regular file, is neither this program's owner's nor root's, can be
read or written by others, is not as described above, or is another role's. */
[[nodiscard]] KeyRing LoadKeys(const std::string& path, Role role);

/** The ring of all roles, for one program that is all of them. @throws KeyError as LoadKeys; also if the files of the
directory are not of one robot. */
[[nodiscard]] KeyRing LoadAllKeys(const std::string& directory);

/** Public keys alone. @param path verify.pub, any .key file, or a directory with one of them.
@throws KeyError as LoadKeys; others may read verify.pub. */
[[nodiscard]] KeyRing LoadPublicKeys(const std::string& path);

}  // namespace forereach
