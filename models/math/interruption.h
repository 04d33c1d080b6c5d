#pragma once
/// How long work ends when its user asks for it.

namespace sparflow {

/// Thrown by the progress callback of long work that cannot be asked to stop in another way. It is no std::exception, so
/// that nothing takes it for an error; work that keeps what it has done so far catches it, and says so in its result.
struct Interruption {};

}  // namespace sparflow
