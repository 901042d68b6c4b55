'use strict';
// WebGL 2: splats and pictures into half-float targets, and from there onto the screen.

class Renderer {
  constructor(canvas, constants) {
    const gl = canvas.getContext('webgl2', {alpha: false, antialias: false, powerPreference: 'high-performance'});
    if (!gl) throw new Error('This page needs WebGL 2, which this browser does not offer or has switched off.');
    this.gl = gl;
    this.constants = constants;
    // 8 bits per blend add up to visible error where hundreds of faint Gaussians overlap.
    const half = gl.getExtension('EXT_color_buffer_float') || gl.getExtension('EXT_color_buffer_half_float');
    this.format = half ? gl.RGBA16F : gl.RGBA8;
    this.maxTexture = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    this.projectionPrograms = new Map();
    this.splatProgram = this.program(splatVertexSource, splatFragmentSource);
    this.pictureProgram = this.program(pictureVertexSource, pictureFragmentSource);
    this.screenProgram = this.program(screenVertexSource, screenFragmentSource);
    this.emptyArray = gl.createVertexArray();
    this.quadArray = this.quads();
    this.projected = this.projectionTarget();
    this.targets = Array.from({length: 2 * PICTURES}, () => this.target());
    gl.disable(gl.DEPTH_TEST);
    this.targets.forEach((_, k) => this.begin(k, 1, 1, {x: 0, y: 0, width: 1, height: 1}));
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`The graphics driver refused a shader: ${[gl.getProgramInfoLog(program), ...logs].join(' ')}`);
    }
    const uniforms = {};
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; ++i) {
      const name = gl.getActiveUniform(program, i).name.replace('[0]', '');
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    return {program, uniforms};
  }

  // Corners of QUADS_AT_ONCE quads. Instances of one quad each would be as many draws where a processor does a card's work.
  quads() {
    const gl = this.gl;
    const corners = Array.from({length: QUADS_AT_ONCE}, (_, k) => [0, 1, 2, 2, 1, 3].map((corner) => 4 * k + corner));
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(corners.flat()), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return array;
  }

  dataTexture(shape, format = this.gl.RGBA32UI) {
    const gl = this.gl;
    if (shape.height > this.maxTexture) {
      throw new Error('This splat is too large for this device: its graphics memory takes no texture of that size.');
    }
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, shape.width, shape.height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  }

  // Room for a splat; its Gaussians come by addPart.
  addSplat(splat) {
    const gl = this.gl;
    const degree = splat.description.degree;
    if (!this.projectionPrograms.has(degree)) {
      this.projectionPrograms.set(degree, this.program(screenVertexSource, projectionSource(degree)));
    }
    splat.geometry = this.dataTexture(splat.geometryShape);
    splat.harmonics = degree > 0 ? this.dataTexture(splat.harmonicsShape) : null;
    splat.visible = 0;
    splat.orders = 0;
    splat.order = this.dataTexture(textureShape(splat.description.count, 1), gl.R32UI);
  }

  // Parts begin with a row of every texture, as kPartGaussians in page_folder.h is a multiple of their width.
  addPart(splat, {first, count, geometry, harmonics}) {
    const gl = this.gl;
    const fill = (texture, texels, data) => {
      const {width, height} = textureShape(count, texels);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, first * texels / width, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, data);
    };
    fill(splat.geometry, 2, geometry);
    if (splat.harmonics) fill(splat.harmonics, splat.harmonicsTexels, harmonics);
  }

  setOrder(splat, order, count) {
    const gl = this.gl;
    const {width, height} = textureShape(count, 1);
    const rows = new Uint32Array(width * height);
    rows.set(order);
    gl.bindTexture(gl.TEXTURE_2D, splat.order);
    if (count > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED_INTEGER, gl.UNSIGNED_INT, rows);
    splat.visible = count;
    ++splat.orders;
  }

  pictureTexture(image) {
    const gl = this.gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    return texture;
  }

  target() {
    const gl = this.gl;
    return {texture: gl.createTexture(), framebuffer: gl.createFramebuffer(), width: 0, height: 0};
  }

  // Makes target k the one to draw to, at the given size and empty, only inside `region` (y down).
  begin(k, width, height, region) {
    const gl = this.gl;
    const target = this.targets[k];
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    if (target.width !== width || target.height !== height) {
      gl.bindTexture(gl.TEXTURE_2D, target.texture);
      const half = this.format === gl.RGBA16F;
      gl.texImage2D(gl.TEXTURE_2D, 0, this.format, width, height, 0, gl.RGBA,
        half ? gl.HALF_FLOAT : gl.UNSIGNED_BYTE, null);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.texture, 0);
      target.width = width;
      target.height = height;
    }
    target.clip = [region.x, region.y, region.x + region.width, region.y + region.height];
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    this.select(k);
  }

  // Makes target k the one to draw to as it is.
  select(k) {
    const gl = this.gl;
    const {framebuffer, width, height, clip: [left, top, right, bottom]} = this.targets[k];
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(Math.floor(left), Math.floor(height - bottom), Math.ceil(right - left), Math.ceil(bottom - top));
  }

  // What a draw of Gaussians begins with: PROJECTED_AT_ONCE of them as corners want them.
  projectionTarget() {
    const gl = this.gl;
    const shape = textureShape(PROJECTED_AT_ONCE, 1);
    const [placed, painted] = [this.dataTexture(shape), this.dataTexture(shape)];
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, placed, 0);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, gl.TEXTURE_2D, painted, 0);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    return {placed, painted, framebuffer};
  }

  // `seen`: intrinsics in pixels of the target; `tangents` as the shader wants them; nothing is drawn before camera z
  // `near`; `widening` as the smoothing filter adds it to variances; `box` as
  // CropBox.seenFrom has it; of the Gaussians in order the `count` ones from
  // `first` on; `share` of the screen's pixels is in the target.
  drawSplat(k, splat, {first, count, ...seen}) {
    this.lookAt(k, splat, seen);
    for (let from = first; from < first + count; from += PROJECTED_AT_ONCE) {
      const part = Math.min(PROJECTED_AT_ONCE, first + count - from);
      this.project(splat, from, part);
      this.drawProjected(k, part);
    }
  }

  // Tells the program that projects how the splat is seen in target k.
  lookAt(k, splat, {axes, eye, intrinsics, tangents, near, widening, box, share}) {
    const gl = this.gl;
    const d = splat.description;
    const {program, uniforms: u} = this.projectionPrograms.get(d.degree);
    const fromCenter = add(eye, d.center, -1);
    gl.useProgram(program);
    gl.uniform1i(u.uGeometry, 0);
    gl.uniform1i(u.uOrder, 2);
    if (splat.harmonics) {
      gl.uniform1i(u.uHarmonics, 1);
      gl.uniform3fv(u.uHarmonicMax, d.shMax);
      gl.uniform1f(u.uHarmonicTop, d.harmonicTop);
    }
    gl.uniformMatrix3fv(u.uRotation, true, axes.flat());
    gl.uniform3fv(u.uTranslation, axes.map((a) => -dot(a, fromCenter)));
    gl.uniform3fv(u.uEye, fromCenter);
    gl.uniform4f(u.uIntrinsics, intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy);
    gl.uniform4fv(u.uClip, this.targets[k].clip);
    gl.uniform4fv(u.uTangents, tangents);
    gl.uniform2fv(u.uLogScale, d.logScale);
    gl.uniform1f(u.uWidening, widening);
    gl.uniform2fv(u.uDc, d.dc);
    gl.uniform1f(u.uScalarTop, 2 ** d.scalarBits - 1);
    gl.uniform1f(u.uDilation, d.dilation * share);
    gl.uniform1f(u.uSoftening, d.dilation * (1 - share));
    gl.uniform1f(u.uMinAlpha, this.constants.minAlpha);
    gl.uniform1f(u.uNear, near);
    gl.uniform3fv(u.uBoxLow, box.low);
    gl.uniform3fv(u.uBoxHigh, box.high);
    gl.uniform1f(u.uOutside, box.outside);
    gl.uniform1i(u.uCompensated, d.compensated ? 1 : 0);
  }

  project(splat, first, count) {
    const gl = this.gl;
    const {program, uniforms: u} = this.projectionPrograms.get(splat.description.degree);
    const {width, height} = textureShape(count, 1);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.projected.framebuffer);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.SCISSOR_TEST);
    gl.useProgram(program);
    this.bindTextures([splat.geometry, splat.harmonics, splat.order]);
    gl.uniform2i(u.uRange, first, first + count);
    gl.bindVertexArray(this.emptyArray);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 3);
  }

  drawProjected(k, count) {
    const gl = this.gl;
    const {program, uniforms: u} = this.splatProgram;
    const target = this.targets[k];
    this.select(k);
    gl.useProgram(program);
    this.bindTextures([this.projected.placed, this.projected.painted]);
    gl.uniform1i(u.uPlaced, 0);
    gl.uniform1i(u.uPainted, 1);
    gl.uniform1i(u.uCount, count);
    gl.uniform2f(u.uSize, target.width, target.height);
    gl.uniform1f(u.uMinAlpha, this.constants.minAlpha);
    gl.uniform1f(u.uMaxAlpha, this.constants.maxAlpha);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this.quadArray);
    gl.drawElementsInstanced(gl.TRIANGLES, 6 * QUADS_AT_ONCE, gl.UNSIGNED_SHORT, 0, Math.ceil(count / QUADS_AT_ONCE));
    gl.bindVertexArray(null);
    gl.disable(gl.BLEND);
    // They are written to next time: nothing may have them as its source then.
    this.bindTextures([null, null]);
  }

  bindTextures(textures) {
    const gl = this.gl;
    textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
  }

  drawPicture(k, texture, {left, top, width, height}) {
    const gl = this.gl;
    const {program, uniforms: u} = this.pictureProgram;
    const target = this.targets[k];
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(u.uPicture, 0);
    gl.uniform4f(u.uRectangle, left, top, width, height);
    gl.uniform2f(u.uSize, target.width, target.height);
    gl.bindVertexArray(this.emptyArray);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  // Four of the targets onto the canvas, which is made to have `fewer` times fewer pixels along either axis than `width` and
  // `height`: where a processor does a card's work, filling them costs more than the Gaussians do. `lenses` are
  // [x, y, radius], two of them.
  show({targets, width, height, fewer, background, split, difference, differenceTop, lenses, lensSize}) {
    const gl = this.gl;
    const {program, uniforms: u} = this.screenProgram;
    const columns = Math.ceil(width / fewer);
    const rows = Math.ceil(height / fewer);
    if (gl.canvas.width !== columns || gl.canvas.height !== rows) Object.assign(gl.canvas, {width: columns, height: rows});
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, columns, rows);
    gl.disable(gl.SCISSOR_TEST);
    gl.useProgram(program);
    ['uFirst', 'uSecond', 'uLensFirst', 'uLensSecond'].forEach((name, k) => {
      gl.activeTexture(gl.TEXTURE0 + k);
      gl.bindTexture(gl.TEXTURE_2D, this.targets[targets[k]].texture);
      gl.uniform1i(u[name], k);
    });
    gl.uniform2f(u.uSize, width, height);
    gl.uniform2f(u.uPixel, width / columns, height / rows);
    gl.uniform3fv(u.uBackground, background);
    gl.uniform2fv(u.uSplit, split);
    gl.uniform1i(u.uDifference, difference ? 1 : 0);
    gl.uniform1f(u.uDifferenceTop, differenceTop);
    gl.uniform3fv(u.uLenses, lenses.flat());
    gl.uniform2f(u.uLensSize, lensSize, lensSize);
    gl.bindVertexArray(this.emptyArray);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}
