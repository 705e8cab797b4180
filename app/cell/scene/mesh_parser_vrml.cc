// Parser of VRML97, by Coin.
#include <Inventor/SbMatrix.h>
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoPrimitiveVertex.h>
#include <Inventor/VRMLnodes/SoVRMLAppearance.h>
#include <Inventor/VRMLnodes/SoVRMLCoordinate.h>
#include <Inventor/VRMLnodes/SoVRMLElevationGrid.h>
#include <Inventor/VRMLnodes/SoVRMLExtrusion.h>
#include <Inventor/VRMLnodes/SoVRMLGroup.h>
#include <Inventor/VRMLnodes/SoVRMLImageTexture.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedFaceSet.h>
#include <Inventor/VRMLnodes/SoVRMLInline.h>
#include <Inventor/VRMLnodes/SoVRMLTransform.h>
#include <Inventor/actions/SoCallbackAction.h>
#include <Inventor/errors/SoDebugError.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/misc/SoProto.h>
#include <Inventor/nodes/SoShape.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "app/base/text/vrml_tokens.h"
#include "app/cell/scene/mesh_parser.h"

namespace plumbline::cell {
namespace {

struct VrmlReading {
  RawMesh raw;
  std::uint64_t most_triangles = 0, nodes = 0;
  bool clockwise = false;            ///< vertex order of the present shape's faces
  std::string refusal;               ///< why the traversal was aborted
  std::string read_error;            ///< first error reported by Coin
  std::vector<std::string> missing;  ///< geometry in other files
};

void KeepFirstError(const SoError* error, void* data) {
  auto& reading = *static_cast<VrmlReading*>(data);
  const std::string_view text = error->getDebugString().getString();
  if (!reading.read_error.empty() || text.find("texture file") != text.npos) return;
  for (const char c : text) {
    reading.read_error += c == '\n' || c == '\t' ? ' ' : c;
  }
}

void IgnoreError(const SoError*, void*) {}

/// Coin does not check indices and would read beyond the coordinates.
void CheckIndices(VrmlReading& reading, const SoVRMLIndexedFaceSet& faces) {
  const SoNode* coord = faces.coord.getValue();
  const bool known = coord != nullptr && coord->isOfType(SoVRMLCoordinate::getClassTypeId());
  const int count = known ? static_cast<const SoVRMLCoordinate*>(coord)->point.getNum() : 0;
  const int32_t* const indices = faces.coordIndex.getValues(0);
  const auto beyond = std::count_if(indices, indices + faces.coordIndex.getNum(),
                                    [count](int32_t i) { return i >= count || i < -1; });
  if (beyond == 0) return;
  reading.refusal = fmt::format(
      "an IndexedFaceSet with {} points has {} indices out of range: repair the model, or export "
      "it again",
      count, beyond);
}

bool RunsClockwise(const SoNode& node) {
  for (const SoType type :
       {SoVRMLIndexedFaceSet::getClassTypeId(), SoVRMLElevationGrid::getClassTypeId(),
        SoVRMLExtrusion::getClassTypeId()}) {
    if (!node.isOfType(type)) continue;
    const SoField* ccw = node.getField("ccw");
    return ccw != nullptr && !static_cast<const SoSFBool*>(ccw)->getValue();
  }
  return false;
}

std::string ReferenceText(std::string_view node, std::string_view url) {
  return fmt::format("{} \"{}\"", node, url.substr(0, kMaxReferenceLength));
}

std::string FirstOf(const SoMFString& urls) {
  return urls.getNum() > 0 ? urls[0].getString() : "";
}

void RefuseInline(const SbString& url, void* data, SoVRMLInline* node) {
  auto& reading = *static_cast<VrmlReading*>(data);
  AddReference(reading.missing, ReferenceText("Inline", url.getString()));
  node->cancelURLDataRequest();
}

SoProto* RefuseExternProto(SoInput*, const SbString* urls, const int count, void* data) {
  auto& reading = *static_cast<VrmlReading*>(data);
  AddReference(reading.missing, ReferenceText("EXTERNPROTO", count > 0 ? urls[0].getString() : ""));
  return nullptr;
}

/// Coin may stop at the first such reference, so all of them are looked up in the text.
Error MissingError(VrmlReading& reading, std::string_view text) {
  for (const text::VrmlReference& one : text::VrmlReferences(text, kMaxReferences)) {
    AddReference(reading.missing, ReferenceText(one.node, one.file));
  }
  return Error{fmt::format(
      "it refers to geometry in other files, which are never opened: {}; export everything into "
      "one file",
      fmt::join(reading.missing, ", "))};
}

Vec3f Vector(const SbVec3f& v) {
  return {v[0], v[1], v[2]};
}

/// Lengths of the transformed unit vectors; Coin multiplies rows by the matrix.
Vec3f ScaleOf(const SbMatrix& X) {
  Vec3f scale;
  for (int i = 0; i < 3; ++i) scale[i] = Vec3f(X[i][0], X[i][1], X[i][2]).norm();
  return scale;
}

void NoteUrls(RawMesh& raw, const SoMFString& urls) {
  for (int i = 0; i < urls.getNum(); ++i) NoteOutside(raw, urls[i].getString());
}

SoCallbackAction::Response AtNode(void* data, SoCallbackAction* action, const SoNode* node) {
  auto& reading = *static_cast<VrmlReading*>(data);
  if (action->getCurPath()->getLength() > kDeepestNode) {
    reading.refusal = fmt::format(
        "nodes are nested more than {} deep, or USE themselves: export it again", kDeepestNode);
  } else if (++reading.nodes > kMostNodes) {
    reading.refusal = fmt::format(
        "more than {} nodes after expanding DEF and USE: simplify the model", kMostNodes);
  } else if (reading.raw.mesh.triangles.size() > reading.most_triangles) {
    reading.refusal =
        TooManyTriangles(reading.raw.mesh.triangles.size(), reading.most_triangles).message;
  }
  if (node->isOfType(SoVRMLTransform::getClassTypeId())) {
    const auto& transform = *static_cast<const SoVRMLTransform*>(node);
    const Vec3f scale = ScaleOf(action->getModelMatrix());  // of the nodes above
    for (const SoSFVec3f* offset : {&transform.translation, &transform.center}) {
      NoteCoordinates(reading.raw, scale.cwiseProduct(Vector(offset->getValue())));
    }
  }
  if (node->isOfType(SoVRMLIndexedFaceSet::getClassTypeId())) {
    CheckIndices(reading, *static_cast<const SoVRMLIndexedFaceSet*>(node));
  }
  if (!reading.refusal.empty()) return SoCallbackAction::ABORT;
  reading.clockwise = RunsClockwise(*node);
  if (node->isOfType(SoVRMLInline::getClassTypeId())) {
    AddReference(reading.missing,
                 ReferenceText("Inline", FirstOf(static_cast<const SoVRMLInline*>(node)->url)));
  } else if (node->isOfType(SoVRMLAppearance::getClassTypeId())) {
    const SoNode* texture = static_cast<const SoVRMLAppearance*>(node)->texture.getValue();
    if (texture != nullptr && texture->isOfType(SoVRMLImageTexture::getClassTypeId())) {
      NoteUrls(reading.raw, static_cast<const SoVRMLImageTexture*>(texture)->url);
    }
  }
  return SoCallbackAction::CONTINUE;
}

void AtTriangle(void* data, SoCallbackAction* action, const SoPrimitiveVertex* a,
                const SoPrimitiveVertex* b, const SoPrimitiveVertex* c) {
  auto& reading = *static_cast<VrmlReading*>(data);
  scene::TriangleMesh& mesh = reading.raw.mesh;
  if (mesh.triangles.size() > reading.most_triangles) return;  // the next node aborts the traversal
  const SbMatrix& X = action->getModelMatrix();
  const Vec3f scale = ScaleOf(X);
  const auto first = static_cast<std::uint32_t>(mesh.vertices_O.size());
  for (const SoPrimitiveVertex* vertex : {a, b, c}) {
    const SbVec3f& stored = vertex->getPoint();
    SbVec3f p;
    X.multVecMatrix(stored, p);
    NoteCoordinates(reading.raw, scale.cwiseProduct(Vector(stored)));
    NoteCoordinates(reading.raw, Vector(p));
    mesh.vertices_O.push_back(Vector(p));
  }
  // Coin does not reverse clockwise faces; a mirroring transformation reverses faces once more.
  const bool turned = reading.clockwise != (X.det3() < 0);
  mesh.triangles.push_back({first, first + (turned ? 2 : 1), first + (turned ? 1 : 2)});
}

void AtLine(void* data, SoCallbackAction*, const SoPrimitiveVertex*, const SoPrimitiveVertex*) {
  ++static_cast<VrmlReading*>(data)->raw.other_elements;
}

void AtPoint(void* data, SoCallbackAction*, const SoPrimitiveVertex*) {
  ++static_cast<VrmlReading*>(data)->raw.other_elements;
}

}  // namespace

void PrepareVrmlParser() {
  SoDB::init();
}

Result<RawMesh> ParseVrml(std::span<const std::uint8_t> bytes, std::uint64_t most_triangles) {
  constexpr std::string_view kHeader = "#VRML V2.0 utf8";
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.substr(0, kHeader.size()) != kHeader) {
    constexpr std::pair<std::string_view, const char*> kOthers[] = {
        {"#VRML V1.0", "; it is VRML 1.0: export it as VRML 2.0 (VRML97)"},
        {"#Inventor",
         "; it is Open Inventor (Coin, SGI): export it as VRML 2.0 (VRML97), STL or OBJ from the "
         "program that wrote it"},
        {"#X3D", "; it is X3D: export it as VRML 2.0 (VRML97)"},
        {"<?xml", "; it is XML, for example X3D: export it as VRML 2.0 (VRML97)"},
        {"\x1f\x8b", "; it is compressed: unpack it with gunzip"},
    };
    const auto* const other =
        std::find_if(std::begin(kOthers), std::end(kOthers),
                     [text](const auto& known) { return text.starts_with(known.first); });
    return Error{fmt::format("not VRML97: it does not start with \"{}\"{}", kHeader,
                             other == std::end(kOthers) ? "" : other->second)};
  }
  VrmlReading reading;
  reading.most_triangles = most_triangles;
  SoReadError::setHandlerCallback(KeepFirstError, &reading);
  SoDebugError::setHandlerCallback(IgnoreError, nullptr);
  SoVRMLInline::setFetchURLCallBack(RefuseInline, &reading);
  SoVRMLImageTexture::setDelayFetchURL(TRUE);
  SoProto::setFetchExternProtoCallback(RefuseExternProto, &reading);
  SoInput input;
  input.setBuffer(bytes.data(), bytes.size());
  SoVRMLGroup* const root = SoDB::readAllVRML(&input);
  if (root == nullptr) {
    if (!reading.missing.empty()) return MissingError(reading, text);
    return Error{fmt::format("not readable as VRML97: {}", reading.read_error)};
  }
  root->ref();  // never released: deleting a malicious scene could exhaust the stack
  SoCallbackAction walk;
  walk.addPreCallback(SoNode::getClassTypeId(), AtNode, &reading);
  walk.addTriangleCallback(SoShape::getClassTypeId(), AtTriangle, &reading);
  walk.addLineSegmentCallback(SoShape::getClassTypeId(), AtLine, &reading);
  walk.addPointCallback(SoShape::getClassTypeId(), AtPoint, &reading);
  walk.apply(root);

  if (!reading.refusal.empty()) return Error{reading.refusal};
  if (!reading.missing.empty()) return MissingError(reading, text);
  if (!reading.read_error.empty()) {
    return Error{fmt::format("damaged VRML97: {}", reading.read_error)};
  }
  if (reading.raw.mesh.triangles.size() > most_triangles) {
    return TooManyTriangles(reading.raw.mesh.triangles.size(), most_triangles);
  }
  return std::move(reading.raw);
}

}  // namespace plumbline::cell
