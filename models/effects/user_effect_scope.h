#pragma once
#include <cstddef>

namespace sparflow {

/// Takes user effects that were added in its lifetime out of the catalogue again. Nothing may point at them any more.
/// For tests, and programs that read the effects of several users in turn.
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
