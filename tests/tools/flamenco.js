// A stand-in of what Flamenco's manual says a job type's script is given: `author` with Task and Command, a job to add tasks to.
// Run as: node flamenco.js SCRIPT SETTINGS; prints the tasks of the job, and what the submit panel is told, as JSON.
const fs = require("fs");
const vm = require("vm");
const [script, given] = process.argv.slice(2);

const types = ["blender", "ffmpeg", "file-management", "misc"];
const commands = ["blender-render", "copy-file", "create-directory", "echo", "exec", "ffmpeg", "frames-to-video",
    "move-directory", "sleep"];

class Task {
    constructor(name, type) {
        if (typeof name !== "string" || !types.includes(type)) throw new Error(`task ${name} of type ${type}`);
        Object.assign(this, { name, type, commands: [], dependencies: [], priority: 50 });
    }
    addCommand(command) { this.commands.push(command); }
    addDependency(task) {
        if (!(task instanceof Task)) throw new Error("a dependency is no task");
        this.dependencies.push(task);
    }
}
const author = {
    Task: (name, type) => new Task(name, type),
    Command: (name, parameters) => {
        if (!commands.includes(name)) throw new Error(`command ${name}`);
        return { name, parameters };
    },
};

const context = vm.createContext({ author, print: () => {}, path: require("path") });
vm.runInContext(fs.readFileSync(script, "utf8") + "\nthis.found = { JOB_TYPE, compileJob };", context);
const { JOB_TYPE, compileJob } = context.found;
const settings = Object.fromEntries(JOB_TYPE.settings.filter(entry => "default" in entry).map(entry => [entry.key, entry.default]));
const tasks = [];
const job = { name: "job", type: "rtgi-bake", settings: Object.assign(settings, JSON.parse(given)), addTask: task => tasks.push(task) };
let error = null;
try {
    compileJob(job);
} catch (thrown) {
    error = String(thrown);
}
for (const task of tasks) {
    for (const other of task.dependencies) {
        if (!tasks.includes(other)) throw new Error(`${task.name} waits for a task that the job does not have`);
    }
}
console.log(JSON.stringify({
    type: JOB_TYPE, error,
    tasks: tasks.map(task => ({ ...task, dependencies: task.dependencies.map(other => tasks.indexOf(other)) })),
}));
