// Pictures (PNG) and videos (WebM) of the scene with its legends.

import { download } from "./dom.js";

/** Copies the scene and its legends onto one canvas. */
function compose(canvas, parts) {
  const [scene] = parts;
  if (canvas.width !== scene.width) canvas.width = scene.width;
  if (canvas.height !== scene.height) canvas.height = scene.height;
  const context = canvas.getContext("2d");
  for (const part of parts) context.drawImage(part, 0, 0, canvas.width, canvas.height);
}

export function savePicture(parts, name) {
  const canvas = document.createElement("canvas");
  compose(canvas, parts);
  canvas.toBlob((blob) => download(blob, `${name}.png`), "image/png");
}

/** Records a video; `frame` is called after each drawn frame. */
export class Recorder {
  /** Returns null if the browser cannot record. */
  static start(parts, name) {
    const kinds = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];
    const kind = window.MediaRecorder && kinds.find((k) => MediaRecorder.isTypeSupported(k));
    return kind ? new Recorder(parts, name, kind) : null;
  }

  constructor(parts, name, kind) {
    this.parts = parts;
    this.canvas = document.createElement("canvas");
    compose(this.canvas, parts);
    const stream = this.canvas.captureStream(30);
    this.recorder = new MediaRecorder(stream, { mimeType: kind, videoBitsPerSecond: 12e6 });
    const chunks = [];
    this.recorder.addEventListener("dataavailable", (event) => chunks.push(event.data));
    this.recorder.addEventListener("stop", () => {
      for (const track of stream.getTracks()) track.stop();
      download(new Blob(chunks, { type: "video/webm" }), `${name}.webm`);
    });
    this.recorder.start(500);
  }

  frame() {
    compose(this.canvas, this.parts);
  }

  stop() {
    this.recorder.stop();
  }
}
