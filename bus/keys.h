/** The keys of one robot. Each role has its own secret. A signature identifies the role, and the secret of one role
cannot sign for another. `forereach keygen` makes a directory:

    certifier.key planner.key perception.key robot.key operator.key logger.key     mode 0600
    verify.pub                                                                     contains no secret

A .key file holds the keys that one role needs: its secret, the group key, and the public keys of all roles. verify.pub
holds only the public keys, which are enough to check a log. A file is text. Every line occurs once, in this order, and
ends with
'\n':

    forereach-key-2                      verify.pub: forereach-verify-2
    robot NAME                           1 to 64 letters, digits, '.', '_' or '-'
    role ROLE                            not in verify.pub
    secret SEED                          the role's Ed25519 seed; not in verify.pub
    group KEY                            not in verify.pub
    public certifier KEY                 and so on, one line a role, in the order above

Keys are 32 bytes in lower-case hexadecimal. The group key makes the refusal of strangers' messages cheap (authentic.h).
It alone cannot make an authentic message. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"

namespace forereach {

/** Keys cannot be made or used. The text names the file, the line, the field and the requirement. */
class KeyError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** The roles. Their numbers are part of every signature and never change. */
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

/** The keys of a program. Secrets are not accessible; they are in memory that core dumps leave out. Copies share
them. */
class KeyRing final {
 public:
  struct Content;  // private to keys.cpp
  explicit KeyRing(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

  [[nodiscard]] const std::string& robot() const;
  [[nodiscard]] const PublicKey& public_key(Role role) const;
  /** Whether it holds the role's secret. */
  [[nodiscard]] bool Holds(Role role) const;
  /** Whether it holds the group key. Every ring does, except one with public keys only. */
  [[nodiscard]] bool HoldsGroup() const;
  /** The robot and its public keys alone: what readers of logs have. */
  [[nodiscard]] KeyRing Public() const;

  /** The role's Ed25519 signature of `bytes`. @throws std::logic_error if the ring does not hold the role's secret. */
  [[nodiscard]] Signature Sign(Role role, Bytes bytes) const;
  /** Whether `signature` is the role's Ed25519 signature of `bytes`. */
  [[nodiscard]] bool IsSigned(Role role, Bytes bytes, const Signature& signature) const;
  /** BLAKE2b-128 of `bytes`, keyed with the group key. @throws std::logic_error if the ring does not hold it. */
  [[nodiscard]] GroupTag Tag(Bytes bytes) const;

  /** Whether robot, secrets, group key and public keys are equal. Secrets are compared in constant time. */
  friend bool operator==(const KeyRing& a, const KeyRing& b);

 private:
  std::shared_ptr<const Content> content_;
};

/** New keys of all roles, derived from `entropy`: equal entropy gives equal keys.
@throws KeyError if `robot` is not a valid name, or libsodium cannot be initialised. */
[[nodiscard]] KeyRing MakeKeyRing(const std::string& robot, const Digest& entropy);

/** Makes the keys of a robot from the system's random numbers, in a new directory that only its owner can read.
@throws KeyError if `directory` exists or cannot be written; it then leaves no files. */
void MakeKeys(const std::string& robot, const std::string& directory);

/** Gives one role a new key in a directory that MakeKeys has made, as after the loss of a machine: ROLE.key has a new
secret, and every file the new public key. The other secrets and the group key stay. ROLE.key need not be there before.

The directory is exchanged for a complete new one in one step (renameat2, RENAME_EXCHANGE), so whatever ends the
process, it holds the old keys or the new ones. The other one is beside it, as `.NAME.replacing`, until it is removed;
if this call cannot do that, the next one does.
@throws KeyError if `robot` is not the robot of the keys, a file is missing, cannot be used (as LoadKeys) or belongs to
other keys than the others, there is anything else in the directory, another call is at work, or the file system cannot
exchange directories. The keys are then the old ones, unless the text says that the new ones are in place. */
void ReplaceKey(const std::string& robot, const std::string& directory, Role role);

/** Reads the ring of one role. @param path one .key file, or a directory, in which ROLE.key is read.
@throws KeyError if the file cannot be read, is not a regular file, belongs to another user than this program's or root,
can be read or written by others, violates the format above, or is another role's. */
[[nodiscard]] KeyRing LoadKeys(const std::string& path, Role role);

/** Reads the ring of all roles, for one program that runs all of them. @throws KeyError as LoadKeys, and if the files
of the directory belong to different robots. */
[[nodiscard]] KeyRing LoadAllKeys(const std::string& directory);

/** Reads only the public keys. @param path verify.pub, any .key file, or a directory with one of them.
@throws KeyError as LoadKeys, except that other users may read verify.pub. */
[[nodiscard]] KeyRing LoadPublicKeys(const std::string& path);

}  // namespace forereach
