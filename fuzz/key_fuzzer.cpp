// Key files: public keys are read only from files that MakeKeys can write.
#include "bus/keys.h"
#include "fuzz/fuzz.h"

bool forereach::Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  return IsTaken([&] {
    const KeyRing keys = LoadPublicKeys(path);
    std::string text(data.begin(), data.end()), open = "robot " + keys.robot() + "\n", open_keys;
    for (const Role role : kAllRoles)
      open_keys += "public " + std::string(RoleName(role)) + " " + ToHex(keys.public_key(role)) + "\n";
    if (text.starts_with("forereach-verify-2\n")) return Require(text == "forereach-verify-2\n" + open + open_keys);
    Require(text.starts_with("forereach-key-2\n" + open + "role ") && text.ends_with("\n" + open_keys));
    int roles = 0;
    for (const Role role : kAllRoles) try {
        const KeyRing own = LoadKeys(path, role);
        ++roles;
        Require(own.IsSigned(role, data, own.Sign(role, data)));
      } catch (const KeyError&) {
      }
    Require(roles == 1);
  });
}
