// The program in a worker: one command at a time, progress as it comes, and an end when it is asked for.
(() => {
  // What the worker does; it is made of this function's text.
  function work() {
    onmessage = async ({ data: { module, words, files } }) => {
      const heard = line => { if (line.startsWith('progress: ')) postMessage({ progress: line.slice(10) }); };
      try {
        postMessage({ done: await globalThis.ndofRun(module, words, files, heard) });
      } catch (error) {
        postMessage({ broken: error.message });
      }
    };
  }

  async function unpacked(base64) {
    const packed = Uint8Array.from(atob(base64), letter => letter.charCodeAt(0));
    return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
  }

  const source = URL.createObjectURL(new Blob([`(${globalThis.ndofSystem})();(${work})();`], { type: 'text/javascript' }));
  const compiled = globalThis.ndofModule ? unpacked(globalThis.ndofModule).then(bytes => WebAssembly.compile(bytes)) : Promise.reject(new Error(app.words.noModule));
  compiled.catch(error => app.say(error.message));
  let worker = null, turn = Promise.resolve(), end = null;

  // Ends what is under way; its promise is refused.
  function cancel() {
    worker?.terminate();
    worker = null;
    end?.();
  }

  // Runs `ndof WORDS…` over these files, after what was asked for before. A promise of { code, output, errors, files, seconds }.
  function run(words, files, progress = () => {}) {
    const begin = async () => {
      const module = await compiled, from = performance.now();
      return new Promise((done, broken) => {
        worker ??= new Worker(source);
        end = () => broken(new Error(app.words.cancelled));
        worker.onmessage = ({ data }) => {
          if (data.done) done({ ...data.done, seconds: (performance.now() - from) / 1000 });
          else if (data.broken) broken(new Error(data.broken));
          else progress(data.progress);
        };
        worker.onerror = event => { cancel(); broken(new Error(event.message)); };
        worker.postMessage({ module, words: ['ndof', ...words], files });
      }).finally(() => { end = null; });
    };
    const result = turn.then(begin);
    turn = result.catch(() => {});
    return result;
  }

  // The sentences of standard error: what went wrong, and what is to be minded.
  const sentences = errors => {
    const lines = errors.split('\n').filter(line => line && !line.startsWith('progress: '));
    const of = kind => lines.filter(line => kind.test(line)).map(line => line.replace(kind, ''));
    return { warnings: of(/^warning\[[\w-]+\]: /), error: lines.filter(line => !/^warning\[/.test(line)).join('\n').replace(/^error: /, '') };
  };

  app.program = { run, cancel, sentences, ready: compiled };
})();
