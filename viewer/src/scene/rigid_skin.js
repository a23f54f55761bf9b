// Skinning for figures whose vertices each belong to one joint: three.js blends four bones a vertex
// and reads the bones' texture four times as often. The figure's bind matrix is the identity.

const CHUNKS = {
  skinbase_vertex: 'mat4 bone = getBoneMatrix(skinIndex.x);',
  skinnormal_vertex: 'objectNormal = mat3(bone) * objectNormal;',
  skinning_vertex: 'transformed = (bone * vec4(transformed, 1.0)).xyz;',
};

function rewrite(shader) {
  for (const [name, text] of Object.entries(CHUNKS))
    shader.vertexShader = shader.vertexShader.replace(`#include <${name}>`, text);
}

// Returns the material, for a SkinnedMesh of such a figure.
export function rigid(material) {
  material.onBeforeCompile = rewrite;
  return material;
}
