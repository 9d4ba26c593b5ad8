// What the page uses of each library, and nothing else: esbuild drops the rest.
export {
  BufferAttribute, BufferGeometry, DataTexture, DoubleSide, LinearFilter, Mesh, OrthographicCamera, PerspectiveCamera,
  Scene, ShaderMaterial, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
export { axisX, axisY, dot, gridY, lineY, plot, pointer, pointerX, ruleY, text, tip } from "@observablehq/plot";
export {
  ascending, extent, interpolateViridis, max, min, quantileSorted, range, symbolCircle, symbolCross, symbolDiamond,
  symbolSquare, symbolStar, symbolTriangle, symbolWye,
} from "d3";
