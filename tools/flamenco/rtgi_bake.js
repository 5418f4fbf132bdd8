// SPDX-License-Identifier: GPL-3.0-or-later
// A Flamenco job type: a bake of light probes, prepared once, made in parts, merged to one bundle (docs/farm.md).
//
// Goes into the folder `scripts` beside Flamenco Manager; *Refresh* in Blender's submit panel then shows it. Workers need Blender with
// the RTGI extension, and the storage that Flamenco shares. Parts need no Blender, but this runs them through it, since that is what
// every worker has.
const JOB_TYPE = {
    label: "RTGI Bake",
    description: "Bake Light Probe Volumes in parts on many workers, and merge them into one bundle",
    settings: [
        { key: "parts", type: "int32", default: 16, description: "How many parts to cut the bake into: some four for each worker",
          visible: "submission" },
        { key: "error", type: "float", default: 0.01, description: "Target relative error of the coefficients", visible: "submission" },
        { key: "seed", type: "int32", default: 0, description: "The same seed gives the same bytes", visible: "submission" },
        { key: "extra", type: "string", default: "", required: false,
          description: "More options of `rtgi prepare`, with spaces between them", visible: "submission" },
        { key: "output", type: "string", subtype: "dir_path", required: true, default: "//rtgi_bake",
          eval: "bpy.path.abspath('//rtgi_bake')", description: "The bundle to write, where all workers can", visible: "submission" },
        { key: "blendfile", type: "string", required: true, eval: "bpy.data.filepath", description: "The file to bake",
          visible: "web" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    if (!(settings.parts >= 1)) {
        throw "RTGI Bake needs at least one part";
    }
    const prepared = settings.output + ".prepared";
    const folder = settings.output + ".parts";
    const extra = (settings.extra || "").split(" ").filter(word => word);

    const prepare = author.Task("prepare", "blender");
    prepare.addCommand(rtgi([settings.blendfile], [
        "prepare", "--out", prepared, "--error", String(settings.error), "--seed", String(settings.seed)].concat(extra)));
    job.addTask(prepare);

    const merge = author.Task("merge", "misc");
    const places = [];
    for (let part = 1; part <= settings.parts; part++) {
        const place = `${folder}/${part}`;
        const task = author.Task(`part ${part} of ${settings.parts}`, "blender");
        // A part that was interrupted goes on where it was.
        task.addCommand(rtgi([], ["bake", prepared, "--part", `${part}/${settings.parts}`, "--out", place, "--resume"]));
        task.addDependency(prepare);
        merge.addDependency(task);
        job.addTask(task);
        places.push(place);
    }
    merge.addCommand(rtgi([], ["merge"].concat(places, ["--out", settings.output])));
    job.addTask(merge);
}

// A command of the add-on in a Blender without a window.
function rtgi(files, words) {
    return author.Command("exec", { exe: "{blender}", args: ["-b"].concat(files, ["--command", "rtgi"], words) });
}
