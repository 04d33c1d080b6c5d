#pragma once
/// The provenance part of a model file: logs, quality, physical effects and the steps that added them. Used by
/// model_file.cpp only.
#include "models/chain/crane_model.h"
#include "models/files/model_file_cursor.h"

namespace sparflow {

/// Adds `data`, `quality`, `user_effects` (when there are any), `effects` and `steps` to the file's root.
void write_provenance(const CraneModel& model, ModelJson& root);

/// Reads what write_provenance wrote. User effects that this program does not have yet are registered.
/// @param model has its machine already
/// @throws InputError as model_from_json, and for an effect that this program does not have
void read_provenance(const ModelCursor& root, CraneModel& model);

}  // namespace sparflow
