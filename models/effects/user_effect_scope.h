#pragma once
#include <cstddef>

namespace sparflow {

/// Removes the user effects that were added in its lifetime from the catalogue; no pointer to them may remain in use.
/// Tests and programs that read the effects of several users one after another need it.
class UserEffectScope {
 public:
  UserEffectScope();
  ~UserEffectScope();
  UserEffectScope(const UserEffectScope&) = delete;
  UserEffectScope& operator=(const UserEffectScope&) = delete;

 private:
  std::size_t before_ = 0;
};

}  // namespace sparflow
